#include "pavel/seeding/curvature.h"

#include <Eigen/Dense>

namespace pavel {
namespace {

struct Form {  // a symmetric form in a plane
    double ee = 0, ef = 0, ff = 0;
};

}  // namespace

std::vector<Curvature> principalCurvatures(const TriangleMesh& mesh) {
    const std::vector<Vec3> normals = vertexNormals(mesh);
    std::vector<Form> forms(mesh.points.size());
    std::vector<double> weights(mesh.points.size(), 0);
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 n = triangleNormal(mesh, t);
        const double area = triangleArea(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
        if (!(area > 0)) continue;
        const Vec3 e = normalized(mesh.corner(t, 1) - mesh.corner(t, 0)), f = cross(n, e);
        // Least squares over the sides: the form maps a side to the change of the normal along it.
        Eigen::Matrix<double, 6, 3> a;
        Eigen::Matrix<double, 6, 1> b;
        for (int k = 0; k < 3; ++k) {
            const size_t p = size_t(mesh.triangles[t][size_t(k)]), q = size_t(mesh.triangles[t][size_t((k + 1) % 3)]);
            const Vec3 d = mesh.points[q] - mesh.points[p], dn = normals[q] - normals[p];
            a.row(2 * k) << dot(d, e), dot(d, f), 0;
            a.row(2 * k + 1) << 0, dot(d, e), dot(d, f);
            b(2 * k) = dot(dn, e);
            b(2 * k + 1) = dot(dn, f);
        }
        const Eigen::Vector3d s = (a.transpose() * a).ldlt().solve(a.transpose() * b);
        for (int k = 0; k < 3; ++k) {
            const size_t v = size_t(mesh.triangles[t][size_t(k)]);
            // The triangle's axes turned into the vertex's tangent plane, about the line both planes share.
            const Vec3 axis = cross(n, normals[v]);
            const double angle = std::atan2(length(axis), dot(n, normals[v]));
            const Vec3 around = normalized(axis, e), e1 = rotatedAbout(e, around, angle);
            const Vec3 x = anyPerpendicular(normals[v]);
            const double c = dot(x, e1), sn = dot(x, cross(normals[v], e1));  // x = c e1 + sn f1, y = -sn e1 + c f1
            forms[v].ee += area * (c * c * s(0) + 2 * c * sn * s(1) + sn * sn * s(2));
            forms[v].ef += area * (-c * sn * s(0) + (c * c - sn * sn) * s(1) + c * sn * s(2));
            forms[v].ff += area * (sn * sn * s(0) - 2 * c * sn * s(1) + c * c * s(2));
            weights[v] += area;
        }
    }
    std::vector<Curvature> result(mesh.points.size());
    for (size_t v = 0; v < result.size(); ++v) {
        if (!(weights[v] > 0)) continue;
        Eigen::Matrix2d form;
        form << forms[v].ee, forms[v].ef, forms[v].ef, forms[v].ff;
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(form / weights[v]);
        const int least = std::abs(solver.eigenvalues()(0)) <= std::abs(solver.eigenvalues()(1)) ? 0 : 1;
        const Vec3 x = anyPerpendicular(normals[v]), y = cross(normals[v], x);
        result[v].least = solver.eigenvalues()(least);
        result[v].greatest = solver.eigenvalues()(1 - least);
        result[v].alongLeast = solver.eigenvectors()(0, least) * x + solver.eigenvectors()(1, least) * y;
    }
    return result;
}

}  // namespace pavel
