#include "pavel/seeding/descent.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>

namespace pavel {
namespace {

using Field = std::vector<Vec3>;

double inner(const Field& a, const Field& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += dot(a[i], b[i]);
    return sum;
}

struct State {
    std::vector<SurfacePoint> seeds;
    std::vector<VoronoiCell> cells;
    Field gradient;  // tangential part of 2 m (x - c)
    double energy = 0;
    double residual = 0;  // rms distance to the centroid in the tangent plane, in spacings
};

State evaluate(const Surface& surface, const CellsOf& cellsOf, std::vector<SurfacePoint> seeds) {
    State s;
    s.cells = cellsOf(seeds);
    s.gradient.resize(seeds.size());
    double sum = 0;
    size_t cells = 0;
    for (size_t i = 0; i < seeds.size(); ++i) {
        const VoronoiCell& c = s.cells[i];
        s.energy += c.energy;
        Vec3 g = 2.0 * (c.mass * seeds[i].position - c.moment);
        const Vec3& n = surface.faceNormal(seeds[i].triangle);
        g -= dot(g, n) * n;
        s.gradient[i] = g;
        if (c.mass > 0) sum += dot(g, g) / (4 * c.mass * c.mass) / c.area, ++cells;
    }
    s.residual = std::sqrt(sum / double(std::max<size_t>(cells, 1)));
    s.seeds = std::move(seeds);
    return s;
}

std::vector<SurfacePoint> moved(const Surface& surface, const std::vector<SurfacePoint>& seeds, const Field& step,
                                double factor) {
    std::vector<SurfacePoint> next(seeds.size());
    tbb::parallel_for(size_t(0), seeds.size(), [&](size_t i) {
        next[i] = dot(step[i], step[i]) > 0 ? surface.walked(seeds[i], factor * step[i]) : seeds[i];
    });
    return next;
}

/// A step longer than a cell would only tangle the cells: shorten it.
void limitSteps(Field& step, const std::vector<VoronoiCell>& cells) {
    for (size_t i = 0; i < step.size(); ++i) {
        const double l = length(step[i]), longest = std::sqrt(cells[i].area);
        if (l > longest) step[i] *= longest / l;
    }
}

Field lloydStep(const State& s) {
    Field step(s.seeds.size(), Vec3(0, 0, 0));
    for (size_t i = 0; i < step.size(); ++i)
        if (s.cells[i].mass > 0) step[i] = -s.gradient[i] / (2 * s.cells[i].mass);
    return step;
}

struct Correction {
    Field s, y;
    double rho;
};

/// Two-loop recursion (J. Nocedal 1980) with the Lloyd step's diagonal as the initial inverse Hessian.
Field lbfgsStep(const State& state, const std::deque<Correction>& history) {
    Field q = state.gradient;
    std::vector<double> alpha(history.size());
    for (size_t k = history.size(); k-- > 0;) {
        alpha[k] = history[k].rho * inner(history[k].s, q);
        for (size_t i = 0; i < q.size(); ++i) q[i] -= alpha[k] * history[k].y[i];
    }
    for (size_t i = 0; i < q.size(); ++i) q[i] /= 2 * std::max(state.cells[i].mass, 1e-300);
    for (size_t k = 0; k < history.size(); ++k) {
        const double beta = history[k].rho * inner(history[k].y, q);
        for (size_t i = 0; i < q.size(); ++i) q[i] += (alpha[k] - beta) * history[k].s[i];
    }
    for (Vec3& d : q) d = -d;
    return q;
}

}  // namespace

std::vector<SurfacePoint> descended(const Surface& surface, const CellsOf& cellsOf, std::vector<SurfacePoint> start,
                                    const Descent& descent, const std::function<void(double)>& progress) {
    const int iterations = descent.iterations;
    const size_t count = start.size();
    State state = evaluate(surface, cellsOf, std::move(start));
    std::deque<Correction> history;
    for (int it = 0; it < iterations && state.residual > descent.tolerance; ++it) {
        const bool lloyd = it < descent.lloydSteps;
        Field step = lloyd ? lloydStep(state) : lbfgsStep(state, history);
        limitSteps(step, state.cells);
        if (!lloyd && inner(step, state.gradient) >= 0) {
            history.clear();
            step = lloydStep(state);
        }
        State next;
        double factor = 1;
        for (int attempt = 0; attempt < 5; ++attempt, factor *= 0.5) {
            next = evaluate(surface, cellsOf, moved(surface, state.seeds, step, factor));
            if (lloyd || next.energy < state.energy) break;
        }
        if (!lloyd && next.energy >= state.energy) {
            if (history.empty()) break;
            history.clear();  // a stale curvature estimate: start again from a Lloyd step
            continue;
        }
        Correction c;
        c.s.resize(count);
        c.y.resize(count);
        for (size_t i = 0; i < count; ++i) {
            c.s[i] = next.seeds[i].position - state.seeds[i].position;
            c.y[i] = next.gradient[i] - state.gradient[i];
        }
        const double sy = inner(c.s, c.y);
        if (sy > 0) {
            c.rho = 1 / sy;
            history.push_back(std::move(c));
            if (history.size() > 7) history.pop_front();
        }
        state = std::move(next);
        if (progress) progress(double(it + 1) / iterations);
    }
    return std::move(state.seeds);
}

}  // namespace pavel
