#pragma once
// A leaf's voxels among its cells of 4^3, and their neighbours, looked up.
#include <cstdint>

namespace pavel {

/// For a voxel of a leaf: its place among the cells of 4^3 (cell * 64 + index there, both x slowest) and back, and its
/// face neighbours at -x +x -y +y -z +z: index in their leaf, with kNext where that is the next one. Marching asks for
/// little else.
struct LeafTables {
    static constexpr uint16_t kNext = 512;
    uint16_t place[512], voxel[512], beside[6][512];
    constexpr LeafTables() : place(), voxel(), beside() {
        for (int v = 0; v < 512; ++v) {
            const int x = v >> 6, y = v >> 3 & 7, z = v & 7, cell = (x >> 2) << 2 | (y >> 2) << 1 | z >> 2;
            place[v] = uint16_t(cell << 6 | (x & 3) << 4 | (y & 3) << 2 | (z & 3));
            voxel[place[v]] = uint16_t(v);
            const int at[3] = {x, y, z}, step[3] = {64, 8, 1};
            for (int side = 0; side < 6; ++side) {
                const int axis = side / 2, way = side % 2 ? 1 : -1;
                const bool next = at[axis] == (way > 0 ? 7 : 0);
                beside[side][v] = uint16_t((v + (next ? -7 : 1) * way * step[axis]) | (next ? kNext : 0));
            }
        }
    }
};
inline constexpr LeafTables kLeafTables;

/// Of a leaf's voxel: which of the leaf's eight cells, and where in it.
inline int cellOf(int v) {
    return kLeafTables.place[v] >> 6;
}
inline int inCell(int v) {
    return kLeafTables.place[v] & 63;
}

}  // namespace pavel
