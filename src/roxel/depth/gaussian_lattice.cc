#include "roxel/depth/gaussian_lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <queue>

#include "roxel/base/error.h"
#include "roxel/base/kernel.h"

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
struct Firing {
  const float *precision, *weighted;           ///< evidence, and precision x mean
  const float *tie_l, *tie_r, *tie_u, *tie_d;  ///< precisions of the four ties
  const float *step_l, *step_r, *step_u, *step_d;
  float *p_l, *p_r, *p_u, *p_d;  ///< messages: precision
  float *h_l, *h_r, *h_u, *h_d;  ///< precision x mean
};

/// Reads the messages to n pixels and replaces them by those that the pixels send:
/// precision 1 / (1 / tie + 1 / P), mean H / P + step, where P and H leave the receiver's own message out.
ROXEL_KERNEL void fire(const Firing& f, int n) {
  const float* __restrict precision = f.precision, * __restrict weighted = f.weighted;
  const float* __restrict tie_l = f.tie_l, * __restrict tie_r = f.tie_r, * __restrict tie_u = f.tie_u, * __restrict tie_d = f.tie_d;
  const float* __restrict step_l = f.step_l, * __restrict step_r = f.step_r, * __restrict step_u = f.step_u, * __restrict step_d = f.step_d;
  float* __restrict p_l = f.p_l, * __restrict p_r = f.p_r, * __restrict p_u = f.p_u, * __restrict p_d = f.p_d;
  float* __restrict h_l = f.h_l, * __restrict h_r = f.h_r, * __restrict h_u = f.h_u, * __restrict h_d = f.h_d;
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

/// Planes in which the even columns of a row stand before the odd ones, so that pixels of one colour, and
/// their ties, lie side by side. Every row, and each of its halves, has a zero in front and kPadding behind.
///
///   row y:  0 | x = 0 2 4 ... | 0 ... | 0 | x = 1 3 5 ... | 0 ...
class SplitPlane {
 public:
  SplitPlane(int width, int height)
      : half_((width + 1) / 2 + 2), data_(static_cast<std::size_t>(2) * half_ * (height + 1)) {}
  /// Columns of parity p in row y, which may be -1.
  float* row(int y, int p) { return data_.data() + (static_cast<std::size_t>(2) * (y + 1) + p) * half_ + 1; }
  const float* row(int y, int p) const { return const_cast<SplitPlane*>(this)->row(y, p); }
  float& at(int x, int y) { return row(y, x & 1)[x >> 1]; }
  float at(int x, int y) const { return row(y, x & 1)[x >> 1]; }

 private:
  std::size_t half_;
  std::vector<float> data_;
};

/// The synchronous schedule, one message a tie at any time.
class Sweeper {
 public:
  explicit Sweeper(const GaussianLattice& field)
      : width_(field.width),
        height_(field.height),
        origin_(middle(field)),
        precision_(plane()),
        weighted_(plane()),
        right_(plane()),
        down_(plane()),
        right_step_(plane()),
        down_step_(plane()),
        right_p_(plane()),
        right_h_(plane()),
        down_p_(plane()),
        down_h_(plane()) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        precision_.at(x, y) = field.precision[i];
        weighted_.at(x, y) =
            field.precision[i] > 0 ? static_cast<float>(field.precision[i] * (field.mean[i] - origin_)) : 0;
        right_.at(x, y) = field.right[i];
        down_.at(x, y) = field.down[i];
        if (field.right_step.empty()) continue;
        right_step_.at(x, y) = field.right_step[i];
        down_step_.at(x, y) = field.down_step[i];
      }
  }

  /// Lets red (0) and black (1) pixels fire in turn, `sweeps` times. Row y fires for the t-th time once its
  /// neighbours have fired t - 1 times: all sweeps pass over the image in one go, a row behind each other.
  void sweep(int sweeps) {
    const int halves = 2 * sweeps;
    for (int front = 0; front < height_ + halves - 1; ++front)
      for (int half = std::max(0, front - height_ + 1); half < halves && half <= front; ++half)
        fire_row(front - half, half & 1);
  }

  /// Beliefs of black pixels, which must be about to fire after red_only(), and of red ones after
  /// black_only().
  void red_only() {
    for (int y = 0; y < height_; ++y) fire_row(y, 0);
  }
  void black_only() {
    for (int y = 0; y < height_; ++y) fire_row(y, 1);
  }
  void read_beliefs(int color, LatticeBeliefs& out, bool track) const {
    for (int y = 0; y < height_; ++y)
      for (int x = (color + y) & 1; x < width_; x += 2) {
        float p = precision_.at(x, y) + right_p_.at(x, y) + down_p_.at(x, y) + down_p_.at(x, y - 1);
        float h = weighted_.at(x, y) + right_h_.at(x, y) + down_h_.at(x, y) + down_h_.at(x, y - 1);
        if (x > 0) p += right_p_.at(x - 1, y), h += right_h_.at(x - 1, y);
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        const float mean = p > 0 ? static_cast<float>(h / p + origin_) : 0;
        if (track && p > 0)
          out.movement =
              std::max(out.movement, std::abs(static_cast<double>(mean) - out.mean[i]) * std::sqrt(p));
        out.mean[i] = mean;
        out.precision[i] = p;
      }
  }

 private:
  SplitPlane plane() const { return SplitPlane(width_, height_); }

  /// Floats keep more of what is near zero.
  static double middle(const GaussianLattice& field) {
    double sum = 0;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < field.mean.size(); ++i)
      if (field.precision[i] > 0) sum += field.mean[i], ++count;
    return count > 0 ? sum / static_cast<double>(count) : 0;
  }

  /// The array of left ties begins one pixel earlier: the tie left of an even column belongs to an odd one.
  static std::size_t left_shift(int p) { return p == 0 ? 1 : 0; }

  void fire_row(int y, int color) {
    const int p = (color + y) & 1;
    const int n = (width_ + 1 - p) / 2;
    const auto left = [&](auto& plane) { return plane.row(y, 1 - p) - left_shift(p); };
    Firing f;
    f.precision = precision_.row(y, p);
    f.weighted = weighted_.row(y, p);
    f.tie_l = left(right_), f.tie_r = right_.row(y, p), f.tie_u = down_.row(y - 1, p),
    f.tie_d = down_.row(y, p);
    f.step_l = left(right_step_), f.step_r = right_step_.row(y, p);
    f.step_u = down_step_.row(y - 1, p), f.step_d = down_step_.row(y, p);
    f.p_l = left(right_p_), f.p_r = right_p_.row(y, p), f.p_u = down_p_.row(y - 1, p),
    f.p_d = down_p_.row(y, p);
    f.h_l = left(right_h_), f.h_r = right_h_.row(y, p), f.h_u = down_h_.row(y - 1, p),
    f.h_d = down_h_.row(y, p);
    fire(f, n);
  }

  int width_, height_;
  double origin_;
  SplitPlane precision_, weighted_, right_, down_, right_step_, down_step_;
  SplitPlane right_p_, right_h_, down_p_, down_h_;
};

LatticeBeliefs propagate_synchronously(const GaussianLattice& field, const PropagationOptions& options,
                                       const std::function<void()>& stop) {
  LatticeBeliefs out;
  out.mean.assign(field.mean.size(), 0);
  out.precision.assign(field.mean.size(), 0);
  Sweeper sweeper(field);
  while (out.sweeps < options.sweeps) {
    stop();
    // The last two sweeps of a round are done one by one, to see how far beliefs still move.
    const int round = std::min(kSweepsAtOnce, options.sweeps - out.sweeps);
    if (round > 2) sweeper.sweep(round - 2);
    out.movement = 0;
    for (int last = std::min(round, 2); last > 0; --last) {
      sweeper.red_only();
      sweeper.read_beliefs(1, out, last == 1);
      sweeper.black_only();
      sweeper.read_beliefs(0, out, last == 1);
    }
    out.sweeps += round;
    if (round >= 2 && out.movement <= options.tolerance) break;
  }
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
