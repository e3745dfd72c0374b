#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace pavel {

struct Picture {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;  ///< row by row from the top
};

/// By the ending: .png (with transparency where there is some), else .jpg.
/// @throws RunError where the file cannot be written
void writePicture(const std::string& path, const Picture& picture);

/// @throws InputError where the name ends in neither
void checkPictureName(const std::string& path);

}  // namespace pavel
