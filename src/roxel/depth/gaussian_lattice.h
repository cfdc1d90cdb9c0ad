#pragma once
/// A Gaussian Markov field on the pixels of an image, and its solution by belief propagation
/// ([Jethwa04] section 6.3; docs/depth.md): every pixel has evidence z ~ N(mean, 1 / precision), and
/// neighbours are tied by z(x + 1) - z(x) ~ N(step, 1 / tie).
///
///   evidence    o   o   o        right[i]: between pixel i and i + 1
///               |   |   |        down[i]:  between pixel i and i + width
///   field       o - o - o

#include <functional>
#include <vector>

namespace roxel {

/// Row-major planes of width x height numbers. The last column of `right` and the last row of `down` must be
/// 0.
struct GaussianLattice {
  GaussianLattice() = default;
  GaussianLattice(int columns, int rows);

  int width = 0;
  int height = 0;
  std::vector<float> mean;        ///< of the evidence; means nothing where its precision is 0
  std::vector<float> precision;   ///< of the evidence, 1 / variance; 0 = none
  std::vector<float> right;       ///< precision of the tie to the right neighbour; 0 = none
  std::vector<float> down;        ///< the same below
  std::vector<float> right_step;  ///< z(x + 1, y) - z(x, y) that the tie asks for; empty = 0 everywhere
  std::vector<float> down_step;   ///< z(x, y + 1) - z(x, y); empty as the other is
};

/// The marginals. Where the field is connected to no evidence, precision is 0 and mean 0. At convergence
/// means are those of the exact solution; precisions are too large on a lattice, which has loops [Weiss01].
struct LatticeBeliefs {
  std::vector<float> mean;
  std::vector<float> precision;
  int sweeps = 0;       ///< as many messages as this many sweeps over all pixels send
  double movement = 0;  ///< largest change of a mean in the last sweep, in deviations of its belief
};

enum class MessageSchedule {
  kSynchronous,  ///< all pixels at once
  kResidual,     ///< always the pixel whose messages would change most [Elidan06]
};

struct PropagationOptions {
  MessageSchedule schedule = MessageSchedule::kSynchronous;
  int sweeps = 100;         ///< at most
  double tolerance = 1e-3;  ///< movement that ends it, in deviations of a belief
};

/// One image, one thread; the same bits every time. `stop` is called now and then, and may throw.
///
/// The lattice is bipartite, so the synchronous schedule is two runs that never meet: messages that black
/// pixels send at even times, and those that they send at odd ones. One of them is computed, in place: a
/// sweep lets all red pixels send, then all black ones, and is two steps of the synchronous schedule.
LatticeBeliefs propagate(
    const GaussianLattice& field, const PropagationOptions& options,
    const std::function<void()>& stop = [] {});

}  // namespace roxel
