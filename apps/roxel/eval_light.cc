#include "eval_light.h"

#include <cmath>

#include "roxel/base/parallel.h"
#include "roxel/eval/true_light.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_truth.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kMostPlaces = 20000;  ///< pixels whose places are looked up, over all views
constexpr double kPi = 3.14159265358979323846;

struct LightView {
  const View* view = nullptr;
  Image photo, light, albedo;  ///< light is empty where the run has one a view, albedo where it is not known
  std::array<float, 3> view_light{1, 1, 1};
};

class LightMeasurement {
 public:
  LightMeasurement(const EvalSource& source, const TrueDepths& depths, Session& session)
      : source_(source), depths_(depths), session_(session) {}

  std::vector<LightMeasure> take() {
    if (!source_.truth || !source_.input) return {};
    read_views();
    options_.stride = stride();
    places_ = shared_places(depth_views_, options_, session_.context().thread_count());
    if (places_.empty()) return {};
    find_lights();
    find_known();
    std::vector<LightMeasure> measures;
    for (const NamedLight& light : lights_) measures.push_back(measure(light));
    return measures;
  }

 private:
  using LightOf = std::function<Eigen::Vector3d(std::size_t place, std::size_t sighting)>;
  struct NamedLight {
    std::string name;
    LightOf of;  ///< 0 where it is not known
  };

  void read_views() {
    const Light light = roxel::light_of_run(source_.run, source_.input->dataset);
    for (std::size_t v = 0; v < source_.view_names.size(); ++v) {
      const View* view = source_.view(source_.view_names[v]);
      if (!view || depths_[v].empty()) continue;
      session_.context().throw_if_cancelled();
      LightView read;
      read.view = view;
      read.photo = source_.input->load(*view).rgb;
      if (read.photo.width() != depths_[v].width() || read.photo.height() != depths_[v].height()) continue;
      read.view_light = light.of_view(static_cast<int>(view - source_.input->dataset.views.data()));
      if (const fs::path file = view_path(source_.run.path, "light", view->name, ".exr");
          light.by_normal && fs::is_regular_file(file))
        read.light = read_image(file.string(), Response{ResponseCurve::kLinear}).rgb;
      if (const auto file = truth_file(*source_.truth, "albedo", view->name))
        read.albedo = read_image(file->string(), Response{ResponseCurve::kLinear}).rgb;
      depth_views_.push_back({view->camera, view->node_idx, depths_[v]});
      views_.push_back(std::move(read));
    }
    lit_ = light.from != LightSource::kNone;
    by_normal_ = light.by_normal;
  }

  void find_lights() {
    lights_ = {{"none", [](std::size_t, std::size_t) { return Eigen::Vector3d(1, 1, 1); }}};
    if (by_normal_) lights_.push_back({"sky", [&](auto p, auto s) { return light_of_view(p, s); }});
    if (lit_) lights_.push_back({"run", [&](auto p, auto s) { return light_of_run(p, s); }});
    find_true_light();
    if (!domes_.empty())
      lights_.push_back({"true dome", [&](auto p, auto s) { return domes_[node_of(p, s)]; }});
    if (!on_places_.empty())
      lights_.push_back({"true light on the surface", [&](auto p, auto s) { return light_on_place(p, s); }});
  }

  /// Sightings that all lights are known in: no light is measured where another is not.
  void find_known() {
    known_.resize(places_.size());
    for (std::size_t p = 0; p < places_.size(); ++p)
      for (std::size_t s = 0; s < places_[p].sightings.size(); ++s)
        known_[p].push_back(std::all_of(lights_.begin(), lights_.end(), [&](const NamedLight& light) {
          return light.of(p, s).minCoeff() > 0;
        }));
  }

  int stride() const {
    double pixels = 0;
    for (const DepthView& view : depth_views_)
      pixels += static_cast<double>(view.depth.width()) * view.depth.height();
    return std::max(1, static_cast<int>(std::lround(std::sqrt(pixels / kMostPlaces))));
  }

  const PlaceSighting& sighting(std::size_t p, std::size_t s) const { return places_[p].sightings[s]; }
  int node_of(std::size_t p, std::size_t s) const { return depth_views_[sighting(p, s).view].node; }

  Eigen::Vector3d light_of_view(std::size_t p, std::size_t s) const {
    return Eigen::Vector3f(views_[sighting(p, s).view].view_light.data()).cast<double>();
  }

  /// 0 where the run knows none.
  Eigen::Vector3d light_of_run(std::size_t p, std::size_t s) const {
    const LightView& view = views_[sighting(p, s).view];
    if (view.light.empty()) return light_of_view(p, s);
    return mean_color(view.light, sighting(p, s)).value_or(Eigen::Vector3d::Zero());
  }

  Eigen::Vector3d light_on_place(std::size_t p, std::size_t s) const {
    return on_places_[p].empty() ? Eigen::Vector3d::Zero().eval() : on_places_[p][node_of(p, s)];
  }

  /// The domes of the truth, by node of the data set, and their light on all places.
  void find_true_light() {
    if (!has_sky_truth(*source_.truth)) return;
    const std::vector<Node>& nodes = source_.input->dataset.nodes;
    std::vector<TrueSky> skies(nodes.size());
    domes_.assign(nodes.size(), Eigen::Vector3d::Zero());
    for (const SkyTruth& truth : read_sky_truth(*source_.truth))
      for (std::size_t n = 0; n < nodes.size(); ++n) {
        const View& view = source_.input->dataset.views[nodes[n].view_idxs.front()];
        if (!view.node_id ||
            "n" + std::string(*view.node_id < 10 ? "0" : "") + std::to_string(*view.node_id) != truth.node)
          continue;
        domes_[n] = truth.horizontal / kPi;
        skies[n] = {truth.map(), truth.sun,
                    truth.disc ? truth.sun_irradiance : Eigen::Vector3d::Zero().eval()};
      }
    if (std::any_of(skies.begin(), skies.end(), [](const TrueSky& sky) { return sky.map.empty(); })) {
      domes_.clear();
      return;
    }
    if (!source_.surface || source_.surface->is_point_set()) return;
    const TrueLight light(*source_.surface, skies);
    on_places_.resize(places_.size());
    parallel_for_blocks(static_cast<std::int64_t>(places_.size()), 64, session_.context().thread_count(),
                        [&](std::int64_t begin, std::int64_t end, int) {
                          session_.context().throw_if_cancelled();
                          for (std::int64_t p = begin; p < end; ++p)
                            on_places_[p] =
                                light.at(places_[p].x,
                                         depth_views_[places_[p].sightings.front().view].camera.pose.centre);
                        });
  }

  /// Of the photograph over the light; none where that or any light is not known.
  std::optional<Eigen::Vector3d> canonical(std::size_t p, std::size_t s, const LightOf& light) const {
    if (!known_[p][s]) return std::nullopt;
    const auto seen = mean_color(views_[sighting(p, s).view].photo, sighting(p, s));
    if (!seen) return std::nullopt;
    return (seen->array() / light(p, s).array()).matrix().eval();
  }

  LightMeasure measure(const NamedLight& light) const {
    LightMeasure m;
    m.name = light.name;
    m.shared_places = static_cast<std::int64_t>(places_.size());
    m.spread = color_spread(
        depth_views_, places_, [&](std::size_t p, std::size_t s) { return canonical(p, s, light.of); },
        options_.least_nodes);
    std::vector<ColorPair> pairs;
    for (std::size_t p = 0; p < places_.size(); ++p)
      for (std::size_t s = 0; s < places_[p].sightings.size(); ++s) {
        const Image& albedo = views_[sighting(p, s).view].albedo;
        if (albedo.empty()) continue;
        const auto truth = mean_color(albedo, sighting(p, s)), found = canonical(p, s, light.of);
        if (!truth || !found) continue;
        ColorPair pair;
        for (int c = 0; c < 3; ++c)
          pair.estimate[c] = static_cast<float>((*found)[c]), pair.truth[c] = static_cast<float>((*truth)[c]);
        pairs.push_back(pair);
      }
    m.albedo = log_error(pairs);
    return m;
  }

  const EvalSource& source_;
  const TrueDepths& depths_;
  Session& session_;
  bool lit_ = false;        ///< the run divides by a light ...
  bool by_normal_ = false;  ///< ... that differs from pixel to pixel
  SharedPlaceOptions options_;
  std::vector<DepthView> depth_views_;
  std::vector<LightView> views_;
  std::vector<SharedPlace> places_;
  std::vector<NamedLight> lights_;
  std::vector<std::vector<bool>> known_;                 ///< by place and sighting
  std::vector<Eigen::Vector3d> domes_;                   ///< by node
  std::vector<std::vector<Eigen::Vector3d>> on_places_;  ///< by place and node
};

}  // namespace

std::vector<LightMeasure> measure_light(const EvalSource& source, const TrueDepths& depths,
                                        Session& session) {
  return LightMeasurement(source, depths, session).take();
}

}  // namespace roxel::cli
