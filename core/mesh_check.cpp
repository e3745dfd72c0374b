#include "pavel/core/mesh_check.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

#include "pavel/core/error.h"
#include "pavel/core/union_find.h"

namespace pavel {
namespace {

struct Edge {
    int lo, hi, triangle, side;
    bool forward;  // runs from lo to hi in its triangle
};

std::vector<Edge> sortedEdges(const TriangleMesh& mesh) {
    std::vector<Edge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) {
            const int a = mesh.triangles[t][size_t(k)], b = mesh.triangles[t][size_t((k + 1) % 3)];
            edges.push_back({std::min(a, b), std::max(a, b), int(t), k, a < b});
        }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return std::tie(a.lo, a.hi, a.triangle) < std::tie(b.lo, b.hi, b.triangle);
    });
    return edges;
}

template <class F>
void forEachEdgeGroup(const std::vector<Edge>& edges, F f) {
    for (size_t i = 0; i < edges.size();) {
        size_t j = i + 1;
        while (j < edges.size() && edges[j].lo == edges[i].lo && edges[j].hi == edges[i].hi) ++j;
        f(i, j);
        i = j;
    }
}

}  // namespace

std::vector<int> triangleComponents(const TriangleMesh& mesh, size_t* count) {
    UnionFind sets(mesh.points.size());
    for (const Triangle& t : mesh.triangles) {
        sets.join(t[0], t[1]);
        sets.join(t[1], t[2]);
    }
    std::map<int, int> number;
    std::vector<int> component(mesh.triangles.size());
    for (size_t t = 0; t < component.size(); ++t)
        component[t] = number.emplace(sets.find(mesh.triangles[t][0]), int(number.size())).first->second;
    *count = number.size();
    return component;
}

std::vector<MeshPart> connectedParts(const TriangleMesh& mesh) {
    size_t count = 0;
    const std::vector<int> component = triangleComponents(mesh, &count);
    std::vector<MeshPart> parts(count);
    std::vector<int> number(mesh.points.size(), -1);
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        MeshPart& part = parts[size_t(component[t])];
        Triangle corners = mesh.triangles[t];
        for (int& v : corners) {
            int& n = number[size_t(v)];
            if (n < 0) n = int(part.mesh.points.size()), part.mesh.points.push_back(mesh.points[size_t(v)]);
            v = n;
        }
        part.mesh.triangles.push_back(corners);
        part.source.push_back(int(t));
    }
    return parts;
}

namespace {

size_t weld(TriangleMesh& mesh) {
    std::vector<int> order(mesh.points.size());
    std::iota(order.begin(), order.end(), 0);
    const auto key = [&](int i) {
        const Vec3& p = mesh.points[size_t(i)];
        return std::make_tuple(p[0], p[1], p[2]);
    };
    std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
    std::vector<int> to(mesh.points.size());
    size_t welded = 0;
    for (size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
        to[size_t(order[i])] = same ? to[size_t(order[i - 1])] : order[i];
        welded += same;
    }
    if (welded == 0) return 0;
    for (Triangle& t : mesh.triangles)
        for (int& v : t) v = to[size_t(v)];
    return welded;
}

bool hasZeroArea(const TriangleMesh& mesh, const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0] ||
           triangleArea(mesh.points[size_t(t[0])], mesh.points[size_t(t[1])], mesh.points[size_t(t[2])]) == 0;
}

/// Drops triangles that name a vertex twice. (Slivers with three vertices stay: removing them would open the surface.)
size_t removeCollapsed(TriangleMesh& mesh) {
    size_t kept = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle tri = mesh.triangles[t];
        if (tri[0] == tri[1] || tri[1] == tri[2] || tri[2] == tri[0]) continue;
        mesh.triangles[kept] = tri;
        if (!mesh.groups.empty()) mesh.groups[kept] = mesh.groups[t];
        ++kept;
    }
    const size_t removed = mesh.triangles.size() - kept;
    mesh.triangles.resize(kept);
    if (!mesh.groups.empty()) mesh.groups.resize(kept);
    return removed;
}

/// Makes orientation agree across manifold edges, then turns components of negative volume. Returns triangles turned.
size_t orient(TriangleMesh& mesh) {
    const auto neighbours = triangleNeighbours(mesh);
    std::vector<char> flip(mesh.triangles.size(), 0), seen(mesh.triangles.size(), 0);
    const auto runsForward = [&](size_t t, int a, int b) {
        for (int k = 0; k < 3; ++k)
            if (mesh.triangles[t][size_t(k)] == a && mesh.triangles[t][size_t((k + 1) % 3)] == b) return true;
        return false;
    };
    size_t turned = 0;
    for (size_t start = 0; start < mesh.triangles.size(); ++start) {
        if (seen[start]) continue;
        std::vector<size_t> component{start};
        seen[start] = 1;
        for (size_t i = 0; i < component.size(); ++i) {
            const size_t t = component[i];
            for (int k = 0; k < 3; ++k) {
                const int n = neighbours[t][size_t(k)];
                if (n < 0 || seen[size_t(n)]) continue;
                const int a = mesh.triangles[t][size_t(k)], b = mesh.triangles[t][size_t((k + 1) % 3)];
                flip[size_t(n)] = char(flip[t] ^ char(runsForward(size_t(n), a, b)));
                seen[size_t(n)] = 1;
                component.push_back(size_t(n));
            }
        }
        double volume = 0;
        size_t flips = 0;
        const Vec3 o = mesh.corner(start, 0);
        for (size_t t : component) {
            const double v = dot(mesh.corner(t, 0) - o, cross(mesh.corner(t, 1) - o, mesh.corner(t, 2) - o));
            volume += flip[t] ? -v : v;
            flips += size_t(flip[t]);
        }
        // Inward facing shells that lie inside another solid are cavities; only a lone negative solid is inside out.
        const bool invert = volume < 0 && (flips > 0 || component.size() == mesh.triangles.size());
        for (size_t t : component) {
            if (bool(flip[t]) == invert) continue;
            std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
            ++turned;
        }
    }
    return turned;
}

std::string describeLoops(const TriangleMesh& mesh, const std::vector<std::vector<int>>& loops) {
    std::string text;
    for (size_t i = 0; i < loops.size() && i < 5; ++i) {
        Vec3 c(0, 0, 0);
        for (int v : loops[i]) c += mesh.points[size_t(v)];
        c /= double(loops[i].size());
        char line[160];
        std::snprintf(line, sizeof line, "%s%zu edges around (%.4g, %.4g, %.4g)", i ? "; " : "", loops[i].size(), c[0],
                      c[1], c[2]);
        text += line;
    }
    if (loops.size() > 5) text += "; and " + std::to_string(loops.size() - 5) + " more";
    return text;
}

size_t fillLoops(TriangleMesh& mesh, const std::vector<std::vector<int>>& loops) {
    for (const auto& loop : loops) {
        Vec3 c(0, 0, 0);
        for (int v : loop) c += mesh.points[size_t(v)];
        const int centre = int(mesh.points.size());
        mesh.points.push_back(c / double(loop.size()));
        for (size_t i = 0; i < loop.size(); ++i) {
            mesh.triangles.push_back({loop[i], loop[(i + 1) % loop.size()], centre});
            if (!mesh.groups.empty()) mesh.groups.push_back(mesh.groups.back());
        }
    }
    return loops.size();
}

void thickenSheet(TriangleMesh& mesh, double thickness) {
    const auto loops = boundaryLoops(mesh);
    const std::vector<Vec3> normals = vertexNormals(mesh);
    const int n = int(mesh.points.size());
    const size_t faces = mesh.triangles.size();
    if (mesh.groups.empty()) mesh.groups.assign(faces, 0), mesh.groupNames = {"outer"};
    mesh.groupNames.push_back("inner");
    const int inner = int(mesh.groupNames.size()) - 1;
    for (int i = 0; i < n; ++i) mesh.points.push_back(mesh.points[size_t(i)] - thickness * normals[size_t(i)]);
    for (size_t t = 0; t < faces; ++t) {
        const Triangle tri = mesh.triangles[t];
        mesh.triangles.push_back({tri[0] + n, tri[2] + n, tri[1] + n});
        mesh.groups.push_back(inner);
    }
    for (const auto& loop : loops) {
        for (size_t i = 0; i < loop.size(); ++i) {
            const int a = loop[i], b = loop[(i + 1) % loop.size()];
            mesh.triangles.push_back({a, b, b + n});
            mesh.triangles.push_back({a, b + n, a + n});
            mesh.groups.insert(mesh.groups.end(), 2, inner);
        }
    }
}

}  // namespace

MeshFacts meshFacts(const TriangleMesh& mesh) {
    MeshFacts f;
    f.vertices = mesh.points.size();
    f.triangles = mesh.triangles.size();
    f.bounds = meshBounds(mesh);
    f.area = meshArea(mesh);
    f.volume = meshVolume(mesh);
    size_t edgeCount = 0;
    const std::vector<Edge> edges = sortedEdges(mesh);
    forEachEdgeGroup(edges, [&](size_t i, size_t j) {
        ++edgeCount;
        if (j - i == 1)
            ++f.boundaryEdges;
        else if (j - i > 2)
            ++f.nonManifoldEdges;
        else if (edges[i].forward == edges[i + 1].forward)
            ++f.misorientedEdges;
    });
    for (const Triangle& t : mesh.triangles) f.degenerateTriangles += hasZeroArea(mesh, t);
    TriangleMesh copy = mesh;
    f.unusedVertices = removeUnusedVertices(copy);
    f.doubledVertices = weld(copy);
    triangleComponents(mesh, &f.components);
    f.euler = long(f.vertices - f.unusedVertices) - long(edgeCount) + long(f.triangles);
    return f;
}

std::vector<std::vector<int>> boundaryLoops(const TriangleMesh& mesh) {
    std::multimap<int, int>
        next;  // a boundary edge a -> b is walked b -> a, so that the filling agrees with the surface
    const std::vector<Edge> edges = sortedEdges(mesh);
    forEachEdgeGroup(edges, [&](size_t i, size_t j) {
        if (j - i != 1) return;
        const Edge& e = edges[i];
        next.emplace(e.forward ? e.hi : e.lo, e.forward ? e.lo : e.hi);
    });
    std::vector<std::vector<int>> loops;
    while (!next.empty()) {
        std::vector<int> loop;
        auto it = next.begin();
        const int first = it->first;
        while (it != next.end()) {
            loop.push_back(it->first);
            const int to = it->second;
            next.erase(it);
            if (to == first) break;
            it = next.find(to);
        }
        loops.push_back(std::move(loop));
    }
    return loops;
}

std::vector<std::string> makeSolid(TriangleMesh& mesh, const std::string& name, const RepairOptions& options) {
    std::vector<std::string> done;
    if (mesh.triangles.empty()) throw InputError(name + ": the mesh has no faces");
    for (size_t i = 0; i < mesh.points.size(); ++i)
        if (!isFinite(mesh.points[i]))
            throw InputError(name + ": vertex " + std::to_string(i + 1) +
                             " has a coordinate that is not a finite number");
    if (const size_t n = weld(mesh)) done.push_back("welded " + std::to_string(n) + " vertices at equal places");
    if (const size_t n = removeCollapsed(mesh)) done.push_back("dropped " + std::to_string(n) + " collapsed faces");
    if (const size_t n = removeUnusedVertices(mesh))
        done.push_back("dropped " + std::to_string(n) + " unused vertices");
    if (mesh.triangles.empty()) throw InputError(name + ": every face is degenerate");
    MeshFacts facts = meshFacts(mesh);
    if (facts.nonManifoldEdges)
        throw InputError(
            name + ": " + std::to_string(facts.nonManifoldEdges) +
            " edges belong to more than two faces; mend the mesh in a modeller (remove doubled or inner faces)");
    if (facts.misorientedEdges || facts.volume < 0)
        if (const size_t n = orient(mesh)) done.push_back("turned " + std::to_string(n) + " faces outward");
    if (facts.boundaryEdges) {
        const auto loops = boundaryLoops(mesh);
        if (options.thicken > 0) {
            thickenSheet(mesh, options.thicken);
            done.push_back("thickened the open sheet");
        } else if (options.fillHoles) {
            done.push_back("filled " + std::to_string(fillLoops(mesh, loops)) + " holes");
            if (meshVolume(mesh) < 0) orient(mesh);
        } else {
            throw InputError(name + ": the mesh is open, with " + std::to_string(loops.size()) + " boundary loop" +
                             (loops.size() > 1 ? "s" : "") + " (" + describeLoops(mesh, loops) +
                             "); close it, or set \"fill_holes\": true, or \"thicken\" for a sheet");
        }
    }
    facts = meshFacts(mesh);
    if (!facts.closed()) throw InputError(name + ": the mesh could not be closed; mend it in a modeller");
    if (facts.misorientedEdges)
        throw InputError(name + ": the faces cannot be oriented consistently (a one-sided surface?)");
    if (!(facts.volume > 0)) throw InputError(name + ": the mesh encloses no volume");
    return done;
}

}  // namespace pavel
