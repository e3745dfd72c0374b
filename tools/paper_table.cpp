#include "pavel/tools/paper_table.h"

namespace pavel {

const std::vector<PaperRow>& paperTable() {
    static const std::vector<PaperRow> rows = {
        {"amphora", "amphora", 1.42, 0.59, 112.5, 58.6, 31.68, 30.2, 64.71, 12340, 716},
        {"sphere", "sphere", 1.43, 0.69, 163.2, 124.3, 49.41, 12.8, 41.39, 17862, 2484},
        {"vase_alternate", "vase, alternate rotation", 1.27, 0.91, 208.6, 135.4, 68.29, 16.7, 418.13, 25564, 1985},
        {"mug", "mug", 1.42, 0.68, 121.7, 59.8, 43.23, 17.0, 200.23, 14305, 850},
        {"bunny", "bunny, offset surface", 1.23, 2.68, 357.8, 138.6, 96.24, 13.7, 204.00, 38487, 1745},
        {"teapot", "teapot", 1.26, 1.82, 202.4, 101.6, 54.27, 32.3, 414.82, 22296, 1386},
        {"vase", "vase, CVT", 1.49, 0.70, 198.1, 158.7, 67.72, 18.4, 94.80, 22616, 2878},
        {"glass", "glass", 1.33, 0.74, 316.5, 101.2, 127.36, 14.0, 395.85, 31279, 1028},
        {"vase_relief", "vase, gallery top", 1.48, 1.43, 68.6, 41.8, 25.87, 17.4, 7.08, 7960, 788},
        {"tile_round", "tile, gallery bottom", 1.32, 1.30, 23.7, 13.7, 5.27, 11.8, 11.14, 2331, 260},
        {"tile_spiky", "tile, gallery middle", 1.49, 0.80, 68.2, 19.0, 5.71, 13.5, 6.68, 2156, 295},
        {"mask", "mask", {}, {}, 322.1, 74.7, 32.26, 16.6, 13.64, 8518, 472},
        {"roses", "roses", {}, {}, 68.2, 19.0, 5.61, 24.6, 1.64, 3405, 325},
        {"ring", "ring, jewels", {}, {}, 50.7, 19.4, 10.70, 21.1, 10.35, 4675, 287},
        {"bracelet", "ring (bracelet), teaser", 1.30, 1.00, 158.0, 83.3, 48.89, 21.8, 61.40, 17877, 1095},
        {"vase_jade", "vase, right", 1.38, 0.79, 200.6, 98.2, 72.94, 16.9, 79.91, 23445, 1249},
        {"vase_gold", "vase, left", 1.44, 0.77, 287.5, 204.2, 64.90, 17.1, 61.49, 23437, 3755},
    };
    return rows;
}

const PaperRow* paperRow(const std::string& example) {
    for (const PaperRow& r : paperTable())
        if (r.example == example) return &r;
    return nullptr;
}

}  // namespace pavel
