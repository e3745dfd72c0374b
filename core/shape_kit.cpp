#include "pavel/core/shape_kit.h"

namespace pavel {

TriangleMesh sweepPoles(int rows, int columns, const std::function<Vec3(double, double)>& at) {
    TriangleMesh m;
    m.points.push_back(at(0, 0));
    for (int i = 1; i < rows; ++i)
        for (int j = 0; j < columns; ++j) m.points.push_back(at(double(i) / rows, double(j) / columns));
    m.points.push_back(at(1, 0));
    const int last = int(m.points.size()) - 1;
    const auto index = [&](int i, int j) {
        return i == 0 ? 0 : i == rows ? last : 1 + (i - 1) * columns + j % columns;
    };
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) {
            const int a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1), d = index(i, j + 1);
            if (i + 1 < rows)
                m.triangles.push_back({a, b, c});
            else
                m.triangles.push_back({a, b, d});
            if (i > 0 && i + 1 < rows) m.triangles.push_back({a, c, d});
        }
    }
    return m;
}

TriangleMesh sweepPeriodic(int rows, int columns, const std::function<Vec3(double, double)>& at) {
    TriangleMesh m;
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) m.points.push_back(at(double(i) / rows, double(j) / columns));
    const auto index = [&](int i, int j) { return (i % rows) * columns + j % columns; };
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) {
            m.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
            m.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
        }
    }
    return m;
}

TriangleMesh revolve(const std::vector<ProfilePoint>& profile, int steps, std::vector<std::string> groupNames) {
    const int rows = int(profile.size()) - 1;
    TriangleMesh m = sweepPoles(rows, steps, [&](double u, double v) {
        const ProfilePoint& p = profile[size_t(std::lround(u * rows))];
        return Vec3(p.r * std::cos(2 * kPi * v), p.r * std::sin(2 * kPi * v), p.z);
    });
    // The profile runs from the bottom up, so the sweep's poles are reversed: turn the triangles.
    for (Triangle& t : m.triangles) std::swap(t[1], t[2]);
    if (groupNames.empty()) return m;
    m.groupNames = std::move(groupNames);
    for (int i = 0; i < rows; ++i) {
        const bool cap = i == 0 || i + 1 == rows;
        m.groups.insert(m.groups.end(), size_t(cap ? steps : 2 * steps), profile[size_t(i)].group);
    }
    return m;
}

}  // namespace pavel
