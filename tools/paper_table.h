#pragma once
// The figures that the paper gives for its gallery (its tables 1 and 2), on 12 cores of a Ryzen 3900X with 32 GB.
#include <optional>
#include <string>
#include <vector>

namespace pavel {

struct PaperRow {
    std::string example;                             ///< built-in scene that rebuilds it
    std::string model;                               ///< as the paper calls it
    std::optional<double> coverage, seedingSeconds;  ///< none where elements were placed by hand
    double deformationSeconds, outputSeconds;        ///< output: marching cubes and smoothing
    double decorationMegavoxels, overlapPercent, baseMegavoxels;
    double extractedKilotriangles, finalKilotriangles;
};

inline constexpr int kPaperCores = 12;

const std::vector<PaperRow>& paperTable();
/// The row that a built-in scene rebuilds, or nullptr.
const PaperRow* paperRow(const std::string& example);

}  // namespace pavel
