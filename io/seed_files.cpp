#include "pavel/io/seed_files.h"

#include <sstream>

#include <openvdb/points/PointConversion.h>

#include <cmath>
#include <fstream>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/vdb_grids.h"

namespace pavel {
namespace {

/// The rotation from an element's frame to where it stands, as a quaternion x, y, z, w (K. Shoemake 1985).
openvdb::math::Quats orientation(const Frame& f) {
    const double m[3][3] = {{f.x[0], f.y[0], f.z[0]}, {f.x[1], f.y[1], f.z[1]}, {f.x[2], f.y[2], f.z[2]}};
    const double trace = m[0][0] + m[1][1] + m[2][2];
    double q[4];
    if (trace > 0) {
        const double s = 2 * std::sqrt(1 + trace);
        q[0] = (m[2][1] - m[1][2]) / s, q[1] = (m[0][2] - m[2][0]) / s, q[2] = (m[1][0] - m[0][1]) / s, q[3] = s / 4;
    } else {
        const int i = m[0][0] > m[1][1] && m[0][0] > m[2][2] ? 0
                      : m[1][1] > m[2][2]                    ? 1
                                                             : 2,
                  j = (i + 1) % 3, k = (i + 2) % 3;
        const double s = 2 * std::sqrt(std::max(0.0, 1 + m[i][i] - m[j][j] - m[k][k]));
        q[i] = s / 4, q[j] = (m[j][i] + m[i][j]) / s, q[k] = (m[k][i] + m[i][k]) / s, q[3] = (m[k][j] - m[j][k]) / s;
    }
    return {float(q[0]), float(q[1]), float(q[2]), float(q[3])};
}

}  // namespace

void writeSeedsPly(const std::string& path, const SeedSet& set) {
    std::ofstream out(path, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\ncomment Pavel seeds\nelement vertex " << set.seeds.size() << '\n';
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "tx", "ty", "tz", "rotation", "scale"})
        out << "property float " << name << '\n';
    out << "property int kind\nproperty int id\nend_header\n";
    for (const Seed& s : set.seeds) {
        float values[11];
        for (int k = 0; k < 3; ++k)
            values[k] = float(s.position[k]), values[3 + k] = float(s.normal[k]), values[6 + k] = float(s.tangent[k]);
        values[9] = float(s.rotation), values[10] = float(s.scale);
        const int32_t numbers[2] = {s.kind, s.id};
        out.write(reinterpret_cast<const char*>(values), sizeof values);
        out.write(reinterpret_cast<const char*>(numbers), sizeof numbers);
    }
    if (!out.flush()) throw RunError(path + ": writing failed (is the disk full?)");
}

std::vector<PlacementOptions> readSeedsPly(const std::string& path, const std::vector<std::string>& names) {
    VertexValues values;
    const std::vector<Vec3> points = readPoints(path, values);
    const auto vector = [&](const char* x, const char* y, const char* z, size_t i) -> std::optional<Vec3> {
        if (!values.count(x) || !values.count(y) || !values.count(z)) return std::nullopt;
        return Vec3(values[x][i], values[y][i], values[z][i]);
    };
    std::vector<PlacementOptions> seeds;
    for (size_t i = 0; i < points.size(); ++i) {
        PlacementOptions p;
        p.position = points[i];
        p.normal = vector("nx", "ny", "nz", i);
        p.tangent = vector("tx", "ty", "tz", i);
        if (values.count("rotation")) p.rotation = values["rotation"][i];
        if (values.count("scale")) p.scale = values["scale"][i];
        if (values.count("kind")) {
            const double kind = values["kind"][i];
            if (!(kind >= 0) || kind >= double(names.size()))
                throw InputError(path + ": seed " + std::to_string(i) + " has a kind that is none of the " +
                                 std::to_string(names.size()) + " elements");
            p.element = names[size_t(kind)];
        }
        seeds.push_back(p);
    }
    return seeds;
}

void writeSeedsVdb(const std::string& path, const SeedSet& set, const VdbOptions& options) {
    namespace points = openvdb::points;
    openvdb::initialize();
    std::vector<openvdb::Vec3s> positions;
    std::vector<int32_t> ids, kinds;
    std::vector<float> scales;
    std::vector<openvdb::math::Quats> orients;
    for (const Seed& s : set.seeds) {
        positions.emplace_back(float(s.position[0]), float(s.position[1]), float(s.position[2]));
        ids.push_back(s.id);
        kinds.push_back(s.kind);
        scales.push_back(float(s.scale));
        orients.push_back(orientation(frameFromNormal(s.position, s.normal, s.tangent, s.rotation, 1)));
    }
    const points::PointAttributeVector<openvdb::Vec3s> wrapper(positions);
    const float voxel = points::computeVoxelSize(wrapper, 8);
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    const auto index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapper, *transform);
    const auto grid =
        points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(*index, wrapper, *transform);
    const auto add = [&](const std::string& name, const auto& values, auto zero) {
        using T = decltype(zero);
        points::appendAttribute(grid->tree(), name, points::TypedAttributeArray<T>::attributeType());
        const points::PointAttributeVector<T> data(values);
        points::populateAttribute(grid->tree(), index->tree(), name, data);
    };
    add("id", ids, int32_t(0));
    add("kind", kinds, int32_t(0));
    add("pscale", scales, 0.f);
    add("orient", orients, openvdb::math::Quats());
    grid->setName("seeds");
    grid->setCreator("Pavel " + std::string(version()));
    writeGrids(path, {grid}, options);
}

void writeStripesObj(const std::string& path, const SeedSet& set) {
    std::ostringstream text;
    text.precision(9);
    size_t first = 1;
    for (bool main : {true, false}) {
        text << "o " << (main ? "main" : "across") << "\n";
        for (const SeedSet::Line& line : set.stripes) {
            if (line.main != main || line.points.size() < 2) continue;
            for (const Vec3& p : line.points) text << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
            text << 'l';
            for (size_t i = 0; i < line.points.size(); ++i) text << ' ' << first + i;
            if (line.closed) text << ' ' << first;
            text << '\n';
            first += line.points.size();
        }
    }
    writeText(path, text.str());
}

}  // namespace pavel
