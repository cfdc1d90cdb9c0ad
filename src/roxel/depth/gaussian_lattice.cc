#include "roxel/depth/gaussian_lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <queue>

#include "roxel/base/error.h"
#include "roxel/base/kernel.h"
#include "roxel/base/zeroed_floats.h"

namespace roxel {
namespace {

constexpr int kSweepsAtOnce =
    5;  ///< rows of so many sweeps stay in the cache; also how often movement is looked at
constexpr float kTiny = 1e-30f;  ///< keeps 0 / 0 at 0

void check(const GaussianLattice& field) {
  const std::size_t count = static_cast<std::size_t>(field.width) * field.height;
  for (const auto* plane : {&field.mean, &field.precision, &field.right, &field.down})
    ROXEL_CHECK_EQ(plane->size(), count);
  ROXEL_CHECK_EQ(field.right_step.size(), field.down_step.size());
  ROXEL_CHECK(field.right_step.empty() || field.right_step.size() == count);
}

/// What a row of pixels of one colour reads and writes, side by side in memory.
struct RowOfPixels {
  const float *precision, *weighted;           ///< evidence, and precision x mean
  const float *tie_l, *tie_r, *tie_u, *tie_d;  ///< precisions of the four ties
  const float *step_l, *step_r, *step_u, *step_d;
  float *p_l, *p_r, *p_u, *p_d;  ///< messages: precision
  float *h_l, *h_r, *h_u, *h_d;  ///< precision x mean
  float *sure, *mean, *moved;    ///< beliefs, and the largest square movement, in variances
};

/// Reads the messages to n pixels and replaces them by those that the pixels send:
/// precision 1 / (1 / tie + 1 / P), mean H / P + step, where P and H leave the receiver's own message out.
/// No two of the arrays overlap.
ROXEL_KERNEL void fire(const RowOfPixels& f, int n) {
  const float* __restrict precision = f.precision, * __restrict weighted = f.weighted;
  const float* __restrict tie_l = f.tie_l, * __restrict tie_r = f.tie_r, * __restrict tie_u = f.tie_u, * __restrict tie_d = f.tie_d;
  const float* __restrict step_l = f.step_l, * __restrict step_r = f.step_r, * __restrict step_u = f.step_u, * __restrict step_d = f.step_d;
  float* __restrict p_l = f.p_l, * __restrict p_r = f.p_r, * __restrict p_u = f.p_u, * __restrict p_d = f.p_d;
  float* __restrict h_l = f.h_l, * __restrict h_r = f.h_r, * __restrict h_u = f.h_u, * __restrict h_d = f.h_d;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float p_lr = precision[i] + p_l[i] + p_r[i], h_lr = weighted[i] + h_l[i] + h_r[i];
    const float p_ud = precision[i] + p_u[i] + p_d[i], h_ud = weighted[i] + h_u[i] + h_d[i];
    const float to_l = p_ud + p_r[i], to_r = p_ud + p_l[i], to_u = p_lr + p_d[i], to_d = p_lr + p_u[i];
    const float g_l = tie_l[i] / (tie_l[i] + to_l + kTiny), g_r = tie_r[i] / (tie_r[i] + to_r + kTiny);
    const float g_u = tie_u[i] / (tie_u[i] + to_u + kTiny), g_d = tie_d[i] / (tie_d[i] + to_d + kTiny);
    const float out_l = g_l * (h_ud + h_r[i]), out_r = g_r * (h_ud + h_l[i]);
    const float out_u = g_u * (h_lr + h_d[i]), out_d = g_d * (h_lr + h_u[i]);
    p_l[i] = g_l * to_l;
    p_r[i] = g_r * to_r;
    p_u[i] = g_u * to_u;
    p_d[i] = g_d * to_d;
    h_l[i] = out_l - p_l[i] * step_l[i];
    h_r[i] = out_r + p_r[i] * step_r[i];
    h_u[i] = out_u - p_u[i] * step_u[i];
    h_d[i] = out_d + p_d[i] * step_d[i];
  }
}

/// What n pixels that are about to fire believe (`nothing`: no message has reached them), and the square of
/// what their mean has moved by since it was last read.
ROXEL_KERNEL void believe(const RowOfPixels& f, float nothing, int n) {
  const float* __restrict precision = f.precision, * __restrict weighted = f.weighted;
  const float* __restrict p_l = f.p_l, * __restrict p_r = f.p_r, * __restrict p_u = f.p_u, * __restrict p_d = f.p_d;
  const float* __restrict h_l = f.h_l, * __restrict h_r = f.h_r, * __restrict h_u = f.h_u, * __restrict h_d = f.h_d;
  float* __restrict sure = f.sure, * __restrict mean = f.mean, * __restrict moved = f.moved;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float p = precision[i] + p_r[i] + p_d[i] + p_u[i] + p_l[i];
    const float h = weighted[i] + h_r[i] + h_d[i] + h_u[i] + h_l[i];
    const float now = p > 0 ? h / p : nothing;
    const float by = now - mean[i], square = by * by * p;
    moved[i] = square > moved[i] ? square : moved[i];
    sure[i] = p;
    mean[i] = now;
  }
}

enum Plane {
  kPrecision,
  kWeighted,
  kRight,
  kDown,
  kRightStep,
  kDownStep,
  kRightP,
  kRightH,
  kDownP,
  kDownH,
  kSure,
  kMean,
  kPlanes
};

/// Planes in which the even columns of a row stand before the odd ones, so that pixels of one colour, and
/// their ties, lie side by side; a row of all planes before the next row, so that what a row needs is near.
/// All of it is 0 at first, and what is no column stays 0.
///
///   row y of a plane:  0 ... 0 | x = 0 2 4 ... | 0 ... 0 | x = 1 3 5 ... |       each column's place: a
///   multiple of 16
class SplitPlanes {
 public:
  SplitPlanes(int width, int height)
      : width_(width),
        lines_(((width + 1) / 2 + kLine - 1) / kLine),
        stride_(static_cast<std::size_t>((lines_ + 1) | 1) * kLine),
        memory_(static_cast<std::size_t>(height + 1) * 2 * kPlanes * stride_) {}
  /// Columns of a parity in row y, which may be -1.
  float* row(Plane plane, int y, int parity) const {
    const std::size_t before = (static_cast<std::size_t>(y + 1) * kPlanes + plane) * 2 + parity;
    return memory_.data() + before * stride_ + kLine;
  }
  void set(Plane plane, int y, const float* values) {
    for (int parity = 0; parity < 2; ++parity)
      for (int x = parity; x < width_; x += 2) row(plane, y, parity)[x / 2] = values[x];
  }
  void get(Plane plane, int y, float* values) const {
    for (int parity = 0; parity < 2; ++parity)
      for (int x = parity; x < width_; x += 2) values[x] = row(plane, y, parity)[x / 2];
  }
  /// Places of a row's columns of one parity, those behind the last column included.
  int places() const { return lines_ * kLine; }

 private:
  static constexpr int kLine = ZeroedFloats::kLine;
  int width_, lines_;
  std::size_t stride_;  ///< odd in lines: rows of planes that are read together do not push each other out
  ZeroedFloats memory_;
};

/// The synchronous schedule, one message a tie at any time.
class Sweeper {
 public:
  explicit Sweeper(const GaussianLattice& field)
      : width_(field.width),
        height_(field.height),
        origin_(middle(field)),
        planes_(width_, height_),
        moved_(planes_.places()),
        before_(planes_.places()) {
    std::vector<float> weighted(width_);
    const std::vector<float> depth_0(width_, -origin());
    for (int y = 0; y < height_; ++y) {
      const std::size_t row = static_cast<std::size_t>(y) * width_;
      for (int x = 0; x < width_; ++x) {
        const float p = field.precision[row + x];
        weighted[x] = p > 0 ? static_cast<float>(p * (field.mean[row + x] - origin_)) : 0;
      }
      planes_.set(kPrecision, y, &field.precision[row]);
      planes_.set(kWeighted, y, weighted.data());
      planes_.set(kMean, y, depth_0.data());
      planes_.set(kRight, y, &field.right[row]);
      planes_.set(kDown, y, &field.down[row]);
      if (field.right_step.empty()) continue;
      planes_.set(kRightStep, y, &field.right_step[row]);
      planes_.set(kDownStep, y, &field.down_step[row]);
    }
  }

  /// Lets red (0) and black (1) pixels fire in turn, `sweeps` times, and says by how many deviations of its
  /// belief the last sweep has moved a mean. Row y fires for the t-th time once its neighbours have fired
  /// t - 1 times: all sweeps pass over the image in one go, a row behind each other. Beliefs are read just
  /// before a pixel fires, when all messages to it are there: black ones, then red ones as if they were to
  /// fire once more; and those of the sweep before, to see how far they move.
  double sweep(int sweeps) {
    const int halves = 2 * sweeps;
    std::fill(moved_.begin(), moved_.end(), 0.0f);
    for (int front = 0; front <= height_ - 1 + halves; ++front)
      for (int half = std::max(0, front - height_ + 1); half <= halves && half <= front; ++half) {
        RowOfPixels row = pixels(front - half, half & 1);
        row.moved = half >= halves - 1 ? moved_.data() : before_.data();
        if (half > 0 && half >= halves - 3) believe(row, -origin(), planes_.places());
        if (half < halves) fire(row, planes_.places());
      }
    return std::sqrt(*std::max_element(moved_.begin(), moved_.end()));
  }

  void write_beliefs(LatticeBeliefs& out) const {
    out.mean.resize(static_cast<std::size_t>(width_) * height_);
    out.precision.resize(out.mean.size());
    for (int y = 0; y < height_; ++y) {
      float* mean = &out.mean[static_cast<std::size_t>(y) * width_];
      float* precision = &out.precision[static_cast<std::size_t>(y) * width_];
      planes_.get(kMean, y, mean);
      planes_.get(kSure, y, precision);
      for (int x = 0; x < width_; ++x) mean[x] = precision[x] > 0 ? static_cast<float>(mean[x] + origin_) : 0;
    }
  }

 private:
  /// Floats keep more of what is near zero.
  static double middle(const GaussianLattice& field) {
    double sum = 0;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < field.mean.size(); ++i)
      if (field.precision[i] > 0) sum += field.mean[i], ++count;
    return count > 0 ? sum / static_cast<double>(count) : 0;
  }

  float origin() const { return static_cast<float>(origin_); }

  /// Pixels of one colour in row y. The ties to the left of even columns belong to the odd column before.
  RowOfPixels pixels(int y, int color) {
    const int own = (color + y) & 1;
    const auto here = [&](Plane plane) { return planes_.row(plane, y, own); };
    const auto left = [&](Plane plane) { return planes_.row(plane, y, 1 - own) - (own == 0 ? 1 : 0); };
    const auto up = [&](Plane plane) { return planes_.row(plane, y - 1, own); };
    RowOfPixels f;
    f.precision = here(kPrecision), f.weighted = here(kWeighted);
    f.tie_l = left(kRight), f.tie_r = here(kRight), f.tie_u = up(kDown), f.tie_d = here(kDown);
    f.step_l = left(kRightStep), f.step_r = here(kRightStep);
    f.step_u = up(kDownStep), f.step_d = here(kDownStep);
    f.p_l = left(kRightP), f.p_r = here(kRightP), f.p_u = up(kDownP), f.p_d = here(kDownP);
    f.h_l = left(kRightH), f.h_r = here(kRightH), f.h_u = up(kDownH), f.h_d = here(kDownH);
    f.sure = here(kSure), f.mean = here(kMean), f.moved = nullptr;
    return f;
  }

  int width_, height_;
  double origin_;
  SplitPlanes planes_;
  std::vector<float> moved_;   ///< for each place in a row, the most of all rows
  std::vector<float> before_;  ///< the same up to the last sweep but one, which nobody asks for
};

LatticeBeliefs propagate_synchronously(const GaussianLattice& field, const PropagationOptions& options,
                                       const std::function<void()>& stop) {
  LatticeBeliefs out;
  Sweeper sweeper(field);
  while (out.sweeps < options.sweeps) {
    stop();
    const int sweeps = std::min(kSweepsAtOnce, options.sweeps - out.sweeps);
    out.movement = sweeper.sweep(sweeps);
    out.sweeps += sweeps;
    if (sweeps >= 2 && out.movement <= options.tolerance) break;
  }
  sweeper.write_beliefs(out);
  return out;
}

/// A message in information form.
struct Message {
  double p = 0, h = 0;
};

/// Fires one pixel after the other, the most urgent first.
class ResidualScheduler {
 public:
  explicit ResidualScheduler(const GaussianLattice& field)
      : field_(field), inbox_(field.mean.size()), urgency_(field.mean.size(), 0) {}

  LatticeBeliefs run(const PropagationOptions& options, const std::function<void()>& stop) {
    for (std::size_t i = 0; i < inbox_.size(); ++i) reconsider(i);
    const std::int64_t limit =
        static_cast<std::int64_t>(options.sweeps) * static_cast<std::int64_t>(inbox_.size());
    std::int64_t fired = 0;
    while (!queue_.empty() && fired < limit) {
      const auto [urgency, negative] = queue_.top();
      queue_.pop();
      const std::size_t i = static_cast<std::size_t>(-negative);
      if (urgency != urgency_[i]) continue;  // an older entry of this pixel
      if (urgency <= options.tolerance) break;
      if (fired++ % 65536 == 0) stop();
      fire(i);
    }
    return beliefs(fired);
  }

 private:
  /// Neighbours are numbered left, right, up, down; the inbox has the message from each.
  struct Tie {
    std::int64_t to = -1;
    double precision = 0, step = 0;  ///< step: z(to) - z(from)
  };

  Tie tie(std::size_t i, int side) const {
    const std::int64_t x = static_cast<std::int64_t>(i) % field_.width,
                       y = static_cast<std::int64_t>(i) / field_.width;
    const bool steps = !field_.right_step.empty();
    switch (side) {
      case 0:
        if (x == 0) return {};
        return {static_cast<std::int64_t>(i) - 1, field_.right[i - 1],
                steps ? -field_.right_step[i - 1] : 0.0};
      case 1:
        if (x + 1 == field_.width) return {};
        return {static_cast<std::int64_t>(i) + 1, field_.right[i], steps ? field_.right_step[i] : 0.0};
      case 2:
        if (y == 0) return {};
        return {static_cast<std::int64_t>(i) - field_.width, field_.down[i - field_.width],
                steps ? -field_.down_step[i - field_.width] : 0.0};
      default:
        if (y + 1 == field_.height) return {};
        return {static_cast<std::int64_t>(i) + field_.width, field_.down[i],
                steps ? field_.down_step[i] : 0.0};
    }
  }

  Message total(std::size_t i, int without) const {
    Message sum{field_.precision[i],
                field_.precision[i] > 0 ? double(field_.precision[i]) * field_.mean[i] : 0.0};
    for (int side = 0; side < 4; ++side) {
      if (side == without) continue;
      sum.p += inbox_[i][side].p;
      sum.h += inbox_[i][side].h;
    }
    return sum;
  }

  Message outgoing(std::size_t i, int side, const Tie& tie) const {
    const Message from = total(i, side);
    if (from.p <= 0 || tie.precision <= 0) return {};
    const double p = tie.precision * from.p / (tie.precision + from.p);
    return {p, p * (from.h / from.p + tie.step)};
  }

  /// How far the receivers' beliefs would move, in deviations, and how much surer they would be.
  void reconsider(std::size_t i) {
    double most = 0;
    for (int side = 0; side < 4; ++side) {
      const Tie t = tie(i, side);
      if (t.to < 0 || t.precision <= 0) continue;
      const Message now = inbox_[t.to][side ^ 1], next = outgoing(i, side, t);
      const Message others = total(t.to, side ^ 1);
      const double p = others.p + next.p;
      if (p <= 0) continue;
      const double before = others.p + now.p > 0 ? (others.h + now.h) / (others.p + now.p) : 0;
      const double after = (others.h + next.h) / p;
      most = std::max({most, std::abs(next.p - now.p) / p, std::abs(after - before) * std::sqrt(p)});
    }
    urgency_[i] = most;
    if (most > 0) queue_.emplace(most, -static_cast<std::int64_t>(i));
  }

  void fire(std::size_t i) {
    for (int side = 0; side < 4; ++side) {
      const Tie t = tie(i, side);
      if (t.to >= 0) inbox_[t.to][side ^ 1] = outgoing(i, side, t);
    }
    urgency_[i] = 0;
    for (int side = 0; side < 4; ++side)
      if (const Tie t = tie(i, side); t.to >= 0) reconsider(static_cast<std::size_t>(t.to));
  }

  LatticeBeliefs beliefs(std::int64_t fired) const {
    LatticeBeliefs out;
    for (std::size_t i = 0; i < inbox_.size(); ++i) {
      const Message sum = total(i, -1);
      out.mean.push_back(sum.p > 0 ? static_cast<float>(sum.h / sum.p) : 0);
      out.precision.push_back(static_cast<float>(sum.p));
      out.movement = std::max(out.movement, urgency_[i]);
    }
    const std::int64_t count = static_cast<std::int64_t>(inbox_.size());
    out.sweeps = count > 0 ? static_cast<int>((fired + count - 1) / count) : 0;
    return out;
  }

  const GaussianLattice& field_;
  std::vector<std::array<Message, 4>> inbox_;
  std::vector<double> urgency_;
  std::priority_queue<std::pair<double, std::int64_t>> queue_;  ///< ties go to the first pixel
};

}  // namespace

GaussianLattice::GaussianLattice(int columns, int rows)
    : width(columns),
      height(rows),
      mean(static_cast<std::size_t>(columns) * rows),
      precision(mean.size()),
      right(mean.size()),
      down(mean.size()) {}

LatticeBeliefs propagate(const GaussianLattice& field, const PropagationOptions& options,
                         const std::function<void()>& stop) {
  check(field);
  if (field.mean.empty()) return {};
  if (options.schedule == MessageSchedule::kResidual) return ResidualScheduler(field).run(options, stop);
  return propagate_synchronously(field, options, stop);
}

}  // namespace roxel
