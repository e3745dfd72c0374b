#pragma once
// The control points of M. Newell's teapot (1975), 32 bicubic Bezier patches. Body and lid are four equal quarters,
// spout and handle two equal halves, so that a row of control points needs but a line here. z is up, the bottom is at 0
// and the knob's top at 3.15.
namespace pavel::teapot {

/// Control points (r, 0) (r, k) (k, r) (0, r) of a quarter, at height z.
struct Ring {
    double r, k, z;
};
constexpr Ring kBody[13] = {
    {0, 0, 0},
    {1.425, 0.798, 0},
    {1.5, 0.84, 0.075},
    {1.5, 0.84, 0.15},  // bottom
    {1.5, 0.84, 0.225},
    {2, 1.12, 0.45},
    {2, 1.12, 0.9},  // lower half
    {2, 1.12, 1.35},
    {1.75, 0.98, 1.875},
    {1.5, 0.84, 2.4},  // upper half
    {1.4375, 0.805, 2.53125},
    {1.3375, 0.749, 2.53125},
    {1.4, 0.784, 2.4},  // rim
};
constexpr Ring kLid[7] = {
    {1.3, 0.728, 2.4}, {1.3, 0.728, 2.55}, {0.4, 0.224, 2.55}, {0.2, 0.112, 2.7},  // lid
    {0, 0, 2.85},      {0.8, 0.45, 3.15},  {0, 0, 3.15},                           // knob
};

/// Control points (x0, 0, z0) (x0, -y, z0) (x1, -y, z1) (x1, 0, z1) of the half at negative y.
struct Loop {
    double x0, z0, x1, z1, y;
};
constexpr Loop kSpout[7] = {
    {1.7, 1.425, 1.7, 0.6, 0.66}, {2.6, 1.425, 3.1, 0.825, 0.66},     {2.3, 2.1, 2.4, 2.025, 0.25},
    {2.7, 2.4, 3.3, 2.4, 0.25},   {2.8, 2.475, 3.525, 2.49375, 0.25}, {2.9, 2.475, 3.45, 2.5125, 0.15},
    {2.8, 2.4, 3.2, 2.4, 0.15},
};
constexpr Loop kHandle[7] = {
    {-1.6, 2.025, -1.5, 2.25, 0.3}, {-2.3, 2.025, -2.5, 2.25, 0.3}, {-2.7, 2.025, -3, 2.25, 0.3},
    {-2.7, 1.8, -3, 1.8, 0.3},      {-2.7, 1.575, -3, 1.35, 0.3},   {-2.5, 1.125, -2.65, 0.9375, 0.3},
    {-2, 0.9, -1.9, 0.6, 0.3},
};

}  // namespace pavel::teapot
