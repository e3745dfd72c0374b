#pragma once
// The paper's studies of its parameters, as rows of pictures.
#include <string>
#include <vector>

namespace pavel {

struct StudyPicture {
    std::string file;  ///< without its ending
    bool placed;       ///< the elements as placed, else packed
    std::vector<std::string> overrides;
};

struct Study {
    std::string title, text, scene;
    std::vector<std::string> columns;
    std::vector<std::vector<StudyPicture>> rows;
};

const std::vector<Study>& studies();

}  // namespace pavel
