#include "roxel/surface/view_choice.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/parallel.h"
#include "roxel/color/color_space.h"

namespace roxel {
namespace {

constexpr std::size_t kMostViews = 12;  ///< candidates a triangle, the best ones
constexpr float kPlain = 0.02f;         ///< detail that is granted to plain triangles
constexpr float kLeastSharpness = 1.0f / 3, kMostSharpness = 1.25f;
constexpr float kTie = 1e-4f;  ///< cost of a view by its number: equals are decided the same way everywhere
constexpr int kTransientRounds = 3;
constexpr int kRounds = 24;
constexpr int kSweeps = 10;
constexpr float kDamping = 0.5f;
constexpr std::int64_t kChoiceGrain = 1024;

Rgb display(const Rgb& linear, const Rgb& gain) {
  Rgb out;
  for (int c = 0; c < 3; ++c) out[c] = srgb_encode(std::clamp(gain[c] * linear[c], 0.0f, 1.0f));
  return out;
}

float median(std::vector<float>& values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

float distance(const Rgb& a, const Rgb& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

/// Which views of one triangle disagree with the others; none where there are too few to say.
std::vector<std::uint8_t> outliers(const std::vector<Rgb>& gains, const Rgb* canonical, double transient,
                                   const std::vector<FaceView>& views) {
  std::vector<std::uint8_t> out(views.size());
  std::vector<Rgb> colors;
  for (const FaceView& view : views) colors.push_back(display(view.color, gains[view.view]));
  if (canonical) colors.push_back(display(*canonical, {1, 1, 1}));
  if (colors.size() < 3) return out;
  Rgb middle;
  std::vector<float> values(colors.size());
  for (int c = 0; c < 3; ++c) {
    std::transform(colors.begin(), colors.end(), values.begin(), [&](const Rgb& color) { return color[c]; });
    middle[c] = median(values);
  }
  for (std::size_t i = 0; i < views.size(); ++i) out[i] = distance(colors[i], middle) > transient;
  return out;
}

/// What is in the way of a view hides a patch, not a triangle here and there: each flag becomes that of most
/// around it.
using Flags = std::vector<std::vector<std::uint8_t>>;
Flags of_most(const Flags& flags, const std::vector<std::vector<FaceView>>& views,
              const FaceNeighbours& neighbours, int threads) {
  Flags out = flags;
  parallel_for_blocks(
      std::ssize(flags), kChoiceGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
        for (std::int64_t f = begin; f < end; ++f)
          for (std::size_t i = 0; i < flags[f].size(); ++i) {
            int balance = flags[f][i] ? 1 : -1;
            for (const std::int32_t n : neighbours[f]) {
              if (n < 0) continue;
              const auto same = std::lower_bound(views[n].begin(), views[n].end(), views[f][i].view,
                                                 [](const FaceView& a, int view) { return a.view < view; });
              if (same != views[n].end() && same->view == views[f][i].view)
                balance += flags[n][same - views[n].begin()] ? 1 : -1;
            }
            if (balance != 0) out[f][i] = balance > 0;
          }
      });
  return out;
}

/// What a triangle may choose from, and what each choice costs by itself.
struct Choices {
  std::vector<int> views;  ///< ascending
  std::vector<float> costs;

  explicit Choices(std::vector<FaceView> from) {
    if (from.size() > kMostViews) {
      std::stable_sort(from.begin(), from.end(),
                       [](const FaceView& a, const FaceView& b) { return a.quality > b.quality; });
      from.resize(kMostViews);
      std::sort(from.begin(), from.end(),
                [](const FaceView& a, const FaceView& b) { return a.view < b.view; });
    }
    float best = 0;
    for (const FaceView& view : from) best = std::max(best, view.quality);
    for (const FaceView& view : from) {
      views.push_back(view.view);
      costs.push_back((best > 0 ? 1 - view.quality / best : 0.0f) + kTie * static_cast<float>(view.view));
    }
  }
  std::size_t size() const { return views.size(); }
};

class Labelling {
 public:
  Labelling(const FaceNeighbours& neighbours, const std::vector<std::vector<FaceView>>& views,
            const ViewChoiceOptions& options)
      : neighbours_(neighbours), seam_(static_cast<float>(options.seam_cost)), threads_(options.threads) {
    for (const auto& of_face : views) choices_.emplace_back(of_face);
    messages_.resize(choices_.size());
    for (std::size_t f = 0; f < choices_.size(); ++f)
      for (auto& message : messages_[f]) message.assign(choices_[f].size(), 0.0f);
  }

  std::vector<int> solve() {
    for (int round = 0; round < kRounds; ++round) pass_messages();
    std::vector<int> chosen(choices_.size(), -1);
    for (std::size_t f = 0; f < choices_.size(); ++f)
      if (choices_[f].size() > 0) chosen[f] = lowest(beliefs(f, -1));
    for (int sweep = 0; sweep < kSweeps && improve(chosen); ++sweep) {
    }
    std::vector<int> labels(chosen.size(), kNoView);
    for (std::size_t f = 0; f < chosen.size(); ++f)
      if (chosen[f] >= 0) labels[f] = choices_[f].views[chosen[f]];
    return labels;
  }

 private:
  using Costs = std::vector<float>;

  static int lowest(const Costs& costs) {
    return static_cast<int>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  }

  /// Own costs and all messages but that over edge `without`.
  Costs beliefs(std::size_t face, int without) const {
    Costs sum = choices_[face].costs;
    for (int k = 0; k < 3; ++k)
      if (k != without)
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += messages_[face][k][i];
    return sum;
  }

  /// What the neighbour over edge k tells `face` of each of its choices.
  Costs incoming(std::size_t face, int k) const {
    const std::int32_t from = neighbours_[face][k];
    const Choices& own = choices_[face];
    Costs message(own.size(), 0.0f);
    if (from < 0 || choices_[from].size() == 0) return message;
    const auto& back = neighbours_[from];
    const int edge =
        static_cast<int>(std::find(back.begin(), back.end(), static_cast<std::int32_t>(face)) - back.begin());
    const Costs sum = beliefs(from, edge);
    const float least = *std::min_element(sum.begin(), sum.end());
    const Choices& other = choices_[from];
    for (std::size_t i = 0; i < own.size(); ++i) {
      message[i] = seam_;
      const auto same = std::lower_bound(other.views.begin(), other.views.end(), own.views[i]);
      if (same != other.views.end() && *same == own.views[i])
        message[i] = std::min(seam_, sum[same - other.views.begin()] - least);
    }
    return message;
  }

  void pass_messages() {
    auto next = messages_;
    parallel_for_blocks(std::ssize(choices_), kChoiceGrain, threads_,
                        [&](std::int64_t begin, std::int64_t end, int) {
                          for (std::int64_t f = begin; f < end; ++f)
                            for (int k = 0; k < 3; ++k) {
                              const Costs message = incoming(f, k);
                              for (std::size_t i = 0; i < message.size(); ++i)
                                next[f][k][i] = kDamping * next[f][k][i] + (1 - kDamping) * message[i];
                            }
                        });
    messages_.swap(next);
  }

  bool improve(std::vector<int>& chosen) const {
    bool changed = false;
    for (std::size_t f = 0; f < chosen.size(); ++f) {
      if (chosen[f] < 0) continue;
      Costs costs = choices_[f].costs;
      for (const std::int32_t n : neighbours_[f])
        if (n >= 0 && chosen[n] >= 0)
          for (std::size_t i = 0; i < costs.size(); ++i)
            if (choices_[f].views[i] != choices_[n].views[chosen[n]]) costs[i] += seam_;
      const int best = lowest(costs);
      if (costs[best] < costs[chosen[f]]) {
        chosen[f] = best;
        changed = true;
      }
    }
    return changed;
  }

  const FaceNeighbours& neighbours_;
  float seam_;
  int threads_;
  std::vector<Choices> choices_;
  std::vector<std::array<Costs, 3>> messages_;  ///< to a triangle over each of its edges, one a choice
};

}  // namespace

void weigh_sharpness(std::vector<std::vector<FaceView>>& views, int threads) {
  parallel_for_blocks(
      std::ssize(views), kChoiceGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
        std::vector<float> details;
        for (std::int64_t f = begin; f < end; ++f) {
          if (views[f].size() < 2) continue;
          details.clear();
          for (const FaceView& view : views[f]) details.push_back(view.detail);
          const float usual = median(details) + kPlain;
          for (FaceView& view : views[f])
            view.quality *= std::clamp((view.detail + kPlain) / usual, kLeastSharpness, kMostSharpness);
        }
      });
}

std::int64_t drop_transients(const FaceNeighbours& neighbours, const std::vector<Rgb>& gains,
                             const std::vector<Rgb>& canonical, const ViewChoiceOptions& options,
                             std::vector<std::vector<FaceView>>& views) {
  Flags flags(views.size());
  parallel_for_blocks(
      std::ssize(views), kChoiceGrain, options.threads, [&](std::int64_t begin, std::int64_t end, int) {
        for (std::int64_t f = begin; f < end; ++f)
          flags[f] =
              outliers(gains, canonical.empty() ? nullptr : &canonical[f], options.transient, views[f]);
      });
  for (int round = 0; round < kTransientRounds; ++round)
    flags = of_most(flags, views, neighbours, options.threads);
  std::int64_t dropped = 0;
  for (std::size_t f = 0; f < views.size(); ++f) {
    std::vector<FaceView> kept;
    for (std::size_t i = 0; i < views[f].size(); ++i)
      if (!flags[f][i]) kept.push_back(views[f][i]);
    if (kept.empty()) continue;
    dropped += std::ssize(views[f]) - std::ssize(kept);
    views[f] = std::move(kept);
  }
  return dropped;
}

std::vector<int> choose_views(const FaceNeighbours& neighbours,
                              const std::vector<std::vector<FaceView>>& views,
                              const ViewChoiceOptions& options) {
  return Labelling(neighbours, views, options).solve();
}

}  // namespace roxel
