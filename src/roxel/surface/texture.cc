#include "roxel/surface/texture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/color/color_space.h"
#include "roxel/surface/atlas.h"
#include "roxel/surface/seam_levelling.h"

namespace roxel {
namespace {

using Eigen::Vector2d;

constexpr int kPadding = 2;       ///< texels around a chart that continue its photograph
constexpr int kUnseenSide = 4;    ///< texels along the side of a triangle that no photograph shows
constexpr double kShrink = 0.93;  ///< of charts, from one try to make them fit to the next

/// Triangles that hang together and take their texture from one view.
struct Chart {
  int view = kNoView;
  std::vector<std::uint32_t> faces;
  Eigen::AlignedBox2d box;  ///< of their pixels in the view
};

/// From linear to display values.
void encode_for_display(const Rgb& gain, Image& rgb) {
  for (std::size_t i = 0; i < rgb.data().size(); ++i)
    rgb.data()[i] = srgb_encode(std::clamp(gain[i % 3] * rgb.data()[i], 0.0f, 1.0f));
}

std::vector<Chart> find_charts(const FaceNeighbours& neighbours, const std::vector<int>& labels) {
  std::vector<Chart> charts;
  std::vector<std::uint8_t> taken(labels.size());
  for (std::uint32_t first = 0; first < labels.size(); ++first) {
    if (taken[first]) continue;
    Chart chart{labels[first], {first}, {}};
    taken[first] = 1;
    for (std::size_t i = 0; i < chart.faces.size() && chart.view != kNoView; ++i)
      for (const std::int32_t n : neighbours[chart.faces[i]])
        if (n >= 0 && !taken[n] && labels[n] == chart.view) {
          taken[n] = 1;
          chart.faces.push_back(static_cast<std::uint32_t>(n));
        }
    charts.push_back(std::move(chart));
  }
  return charts;
}

/// A triangle in the picture, and weights of its corners at any place of it.
class FlatTriangle {
 public:
  explicit FlatTriangle(const std::array<Vector2d, 3>& corners) : corners_(corners) {
    const Vector2d p = corners[1] - corners[0], q = corners[2] - corners[0];
    const double doubled = p.x() * q.y() - p.y() * q.x();
    inverse_ = std::abs(doubled) > 1e-12 ? 1 / doubled : 0.0;
  }
  std::array<double, 3> weights(const Vector2d& at) const {
    if (inverse_ == 0) return {1.0 / 3, 1.0 / 3, 1.0 / 3};
    const Vector2d p = corners_[1] - corners_[0], q = corners_[2] - corners_[0], d = at - corners_[0];
    const double s = (d.x() * q.y() - d.y() * q.x()) * inverse_,
                 t = (p.x() * d.y() - p.y() * d.x()) * inverse_;
    return {1 - s - t, s, t};
  }
  Eigen::AlignedBox2d box() const {
    Eigen::AlignedBox2d box(corners_[0]);
    return box.extend(corners_[1]).extend(corners_[2]);
  }

 private:
  std::array<Vector2d, 3> corners_;
  double inverse_ = 0;
};

/// The weights nearest to a triangle's own: no farther out than its edges.
std::array<double, 3> clamped(std::array<double, 3> weights) {
  double sum = 0;
  for (double& w : weights) sum += w = std::max(w, 0.0);
  for (double& w : weights) w /= sum;
  return weights;
}

class Texturing {
 public:
  Texturing(Surface surface, int view_count, const TextureViewLoader& load, const TextureOptions& options,
            RunContext& context)
      : view_count_(view_count), load_(load), options_(options), context_(context), rays_(surface.mesh) {
    out_.surface = std::move(surface);
  }

  TexturedSurface make() {
    choose();
    place_charts();
    level();
    paint();
    return std::move(out_);
  }

 private:
  const Mesh& mesh() const { return out_.surface.mesh; }

  void choose() {
    SightOptions sight;
    sight.tolerance = options_.sight_tolerance;
    sight.views_held = options_.views_held;
    auto views = face_views(mesh(), rays_, view_count_, load_, sight, context_);
    out_.gains.assign(view_count_, Rgb{1, 1, 1});
    if (options_.match_light) out_.gains = light_gains(out_.surface, views, view_count_);
    ViewChoiceOptions choice;
    choice.seam_cost = options_.seam_cost;
    choice.transient = options_.transient;
    choice.threads = context_.thread_count();
    std::vector<Rgb> canonical;
    if (options_.match_light)
      for (const auto& [a, b, c] : mesh().triangles) canonical.push_back(mean_color(a, b, c));
    neighbours_ = face_neighbours(mesh());
    out_.transients = drop_transients(neighbours_, out_.gains, canonical, choice, views);
    weigh_sharpness(views, context_.thread_count());
    labels_ = choose_views(neighbours_, views, choice);
    out_.unseen = std::count(labels_.begin(), labels_.end(), kNoView);
    charts_ = find_charts(neighbours_, labels_);
    out_.charts =
        std::count_if(charts_.begin(), charts_.end(), [](const Chart& c) { return c.view != kNoView; });
    points_ = chart_points(mesh(), labels_);
    seams_ = seams(mesh(), neighbours_, labels_, points_);
  }

  Rgb mean_color(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    Rgb mean{};
    for (const std::uint32_t corner : {a, b, c})
      for (int k = 0; k < 3; ++k) mean[k] += out_.surface.colors[corner][k] / 3;
    return mean;
  }

  /// Calls visit(v, camera, display values) for every view that has charts, in order.
  template <class Visit>
  void for_each_view(const Visit& visit) {
    std::vector<std::uint8_t> has_charts(view_count_);
    for (const Chart& chart : charts_)
      if (chart.view != kNoView) has_charts[chart.view] = 1;
    std::vector<int> wanted;
    for (int v = 0; v < view_count_; ++v)
      if (has_charts[v]) wanted.push_back(v);
    const auto shown = [&](std::int64_t i) {
      context_.throw_if_cancelled();
      TextureView view = load_(wanted[i]);
      encode_for_display(out_.gains[wanted[i]], view.rgb);
      return view;
    };
    for_each_prepared(
        std::ssize(wanted), options_.views_held, context_.thread_count(), shown,
        [&](std::int64_t i, const TextureView& view) { visit(wanted[i], view.camera, view.rgb); });
  }

  void place_charts() {
    cameras_.resize(view_count_);
    pixels_.assign(points_.point.size(), Vector2d::Zero());
    for_each_view([&](int v, const PinholeCamera& camera, const Image& display) {
      cameras_[v] = camera;
      colors_in_view(v, camera, display);
    });
    for (Chart& chart : charts_)
      for (const std::uint32_t f : chart.faces)
        if (chart.view != kNoView)
          for (const std::int32_t n : points_.of_face[f]) chart.box.extend(pixels_[n]);
    out_.scale = 0;
    if (!try_to_pack())
      throw_invalid("--texture-size", std::to_string(options_.largest_side),
                    "at least " + std::to_string(std::max(size_.width, size_.height)) + ", for " +
                        std::to_string(charts_.size()) + " charts of a few texels each");
    for (out_.scale = 1; !try_to_pack(); out_.scale *= kShrink) context_.throw_if_cancelled();
    write_uvs();
  }

  void colors_in_view(int v, const PinholeCamera& camera, const Image& display) {
    for (std::size_t n = 0; n < pixels_.size(); ++n)
      if (points_.view[n] == v) pixels_[n] = camera.project(mesh().points[points_.point[n]]).head<2>();
    if (!seam_colors_) seam_colors_.emplace(mesh(), neighbours_, labels_, points_);
    seam_colors_->add(v, camera, display);
  }

  bool try_to_pack() {
    rects_.assign(charts_.size(), {});
    double area = 0;
    int widest = kUnseenSide;
    for (std::size_t i = 0; i < charts_.size(); ++i) {
      AtlasRect& rect = rects_[i];
      rect.width = rect.height = kUnseenSide;
      if (charts_[i].view != kNoView) {
        const Vector2d size = out_.scale * charts_[i].box.sizes();
        rect.width = std::max(1, static_cast<int>(std::ceil(size.x()))) + 2 * kPadding + 1;
        rect.height = std::max(1, static_cast<int>(std::ceil(size.y()))) + 2 * kPadding + 1;
      }
      area += static_cast<double>(rect.width) * rect.height;
      widest = std::max({widest, rect.width, rect.height});
    }
    const int side = std::max(widest, static_cast<int>(std::ceil(std::sqrt(area * 1.02))));
    if (side > options_.largest_side && out_.scale > 0) return false;
    size_ = pack(side, rects_);
    return std::max(side, size_.height) <= options_.largest_side;
  }

  /// Where the chart's view's pixel lies in the picture.
  Vector2d place(std::size_t chart, const Vector2d& pixel) const {
    const Vector2d corner(rects_[chart].x + kPadding + 0.5, rects_[chart].y + kPadding + 0.5);
    return corner + out_.scale * (pixel - charts_[chart].box.min());
  }
  Vector2d pixel_at(std::size_t chart, const Vector2d& place) const {
    const Vector2d corner(rects_[chart].x + kPadding + 0.5, rects_[chart].y + kPadding + 0.5);
    return charts_[chart].box.min() + (place - corner) / out_.scale;
  }

  std::array<Vector2d, 3> places_of(std::size_t chart, std::uint32_t face) const {
    const auto& n = points_.of_face[face];
    return {place(chart, pixels_[n[0]]), place(chart, pixels_[n[1]]), place(chart, pixels_[n[2]])};
  }

  std::array<Vector2d, 3> places_of_unseen(std::size_t chart) const {
    const Vector2d corner(rects_[chart].x + 0.5, rects_[chart].y + 0.5);
    const double far = kUnseenSide - 1.5;
    return {corner, corner + Vector2d(far, 0), corner + Vector2d(0, far)};
  }

  void write_uvs() {
    out_.uv_corners.resize(mesh().triangles.size());
    const auto uv_of = [&](const Vector2d& at) -> Eigen::Vector2f {
      return {static_cast<float>(at.x() / size_.width), static_cast<float>(at.y() / size_.height)};
    };
    struct Numbered {
      std::uint32_t chart = 0xffffffffu, uv = 0;
    };
    std::vector<Numbered> last(points_.point.size());
    for (std::uint32_t i = 0; i < charts_.size(); ++i)
      for (const std::uint32_t f : charts_[i].faces) {
        const auto places = charts_[i].view == kNoView ? places_of_unseen(i) : places_of(i, f);
        for (int k = 0; k < 3; ++k) {
          const std::int32_t n = points_.of_face[f][k];
          if (n >= 0 && last[n].chart == i) {
            out_.uv_corners[f][k] = last[n].uv;
            continue;
          }
          const auto uv = static_cast<std::uint32_t>(out_.uvs.size());
          if (n >= 0) last[n] = {i, uv};
          out_.uv_corners[f][k] = uv;
          out_.uvs.push_back(uv_of(places[k]));
        }
      }
  }

  double seam_rms(const std::vector<Rgb>& colors) const {
    double sum = 0;
    for (const Seam& seam : seams_)
      for (int c = 0; c < 3; ++c) {
        const double d =
            colors[seam.a][c] + corrections_[seam.a][c] - colors[seam.b][c] - corrections_[seam.b][c];
        sum += d * d;
      }
    return seams_.empty() ? 0.0 : std::sqrt(sum / (3.0 * static_cast<double>(seams_.size())));
  }

  void level() {
    corrections_.assign(points_.point.size(), Rgb{});
    if (!seam_colors_) return;
    const std::vector<Rgb> colors = seam_colors_->means();
    out_.seam_before = seam_rms(colors);
    if (options_.level_seams) corrections_ = seam_corrections(points_, seams_, colors);
    out_.seam_after = seam_rms(colors);
  }

  void paint() {
    out_.picture = Image(std::max(1, size_.width), std::max(1, size_.height), 3);
    for_each_view([&](int v, const PinholeCamera&, const Image& display) {
      parallel_for(std::ssize(charts_), context_.thread_count(), [&](std::int64_t i, int) {
        if (charts_[i].view == v) paint_chart(i, display);
      });
    });
    for (std::size_t i = 0; i < charts_.size(); ++i)
      if (charts_[i].view == kNoView) paint_unseen(i);
  }

  void paint_chart(std::size_t chart, const Image& display) {
    const AtlasRect& rect = rects_[chart];
    const std::vector<Rgb> corrections = spread_corrections(chart);
    for (int y = 0; y < rect.height; ++y)
      for (int x = 0; x < rect.width; ++x) {
        const Vector2d pixel = pixel_at(chart, Vector2d(rect.x + x + 0.5, rect.y + y + 0.5));
        const Rgb color = bilinear(display, pixel.x(), pixel.y());
        const Rgb& added = corrections[static_cast<std::size_t>(y) * rect.width + x];
        for (int c = 0; c < 3; ++c)
          out_.picture.pixel(rect.x + x, rect.y + y)[c] = std::clamp(color[c] + added[c], 0.0f, 1.0f);
      }
  }

  /// The correction of every texel of a chart: that of the triangle that covers it, or that it is nearest to.
  std::vector<Rgb> spread_corrections(std::size_t chart) const {
    const AtlasRect& rect = rects_[chart];
    std::vector<Rgb> added(static_cast<std::size_t>(rect.width) * rect.height, Rgb{});
    std::vector<float> inside(added.size(), -std::numeric_limits<float>::infinity());
    for (const std::uint32_t f : charts_[chart].faces) {
      const FlatTriangle flat(places_of(chart, f));
      const Eigen::AlignedBox2d box = flat.box();
      const int x0 = std::max(static_cast<int>(box.min().x()) - rect.x - kPadding, 0);
      const int y0 = std::max(static_cast<int>(box.min().y()) - rect.y - kPadding, 0);
      const int x1 = std::min(static_cast<int>(box.max().x()) - rect.x + kPadding, rect.width - 1);
      const int y1 = std::min(static_cast<int>(box.max().y()) - rect.y + kPadding, rect.height - 1);
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
          const auto weights = flat.weights(Vector2d(rect.x + x + 0.5, rect.y + y + 0.5));
          const auto least = static_cast<float>(*std::min_element(weights.begin(), weights.end()));
          const std::size_t at = static_cast<std::size_t>(y) * rect.width + x;
          if (least <= inside[at]) continue;
          inside[at] = least;
          added[at] = correction(f, clamped(weights));
        }
    }
    return added;
  }

  Rgb correction(std::uint32_t face, const std::array<double, 3>& weights) const {
    Rgb sum{};
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c)
        sum[c] += static_cast<float>(weights[k]) * corrections_[points_.of_face[face][k]][c];
    return sum;
  }

  void paint_unseen(std::size_t chart) {
    const AtlasRect& rect = rects_[chart];
    const FlatTriangle flat(places_of_unseen(chart));
    const auto& corners = mesh().triangles[charts_[chart].faces.front()];
    for (int y = 0; y < rect.height; ++y)
      for (int x = 0; x < rect.width; ++x) {
        const auto weights = clamped(flat.weights(Vector2d(rect.x + x + 0.5, rect.y + y + 0.5)));
        for (int c = 0; c < 3; ++c) {
          float light = 0;
          for (int k = 0; k < 3; ++k)
            light += static_cast<float>(weights[k]) * out_.surface.colors[corners[k]][c];
          out_.picture.pixel(rect.x + x, rect.y + y)[c] = std::clamp(srgb_encode(light), 0.0f, 1.0f);
        }
      }
  }

  int view_count_;
  const TextureViewLoader& load_;
  const TextureOptions& options_;
  RunContext& context_;
  MeshRays rays_;
  TexturedSurface out_;
  FaceNeighbours neighbours_;
  std::vector<int> labels_;
  std::vector<Chart> charts_;
  std::vector<PinholeCamera> cameras_;
  ChartPoints points_;
  std::vector<Seam> seams_;
  std::vector<Vector2d> pixels_;  ///< of chart points in their views
  std::optional<SeamColors> seam_colors_;
  std::vector<Rgb> corrections_;
  std::vector<AtlasRect> rects_;
  AtlasSize size_;
};

}  // namespace

TexturedSurface textured(Surface surface, int view_count, const TextureViewLoader& load,
                         const TextureOptions& options, RunContext& context) {
  ROXEL_CHECK_EQ(surface.colors.size(), surface.mesh.points.size());
  return Texturing(std::move(surface), view_count, load, options, context).make();
}

std::function<Rgb(const MeshHit&)> texture_colors(const TexturedSurface& textured) {
  return [&textured](const MeshHit& hit) {
    Eigen::Vector2d at = Eigen::Vector2d::Zero();
    for (int k = 0; k < 3; ++k)
      at += hit.corners[k] * textured.uvs[textured.uv_corners[hit.triangle][k]].cast<double>();
    Rgb color =
        bilinear(textured.picture, at.x() * textured.picture.width(), at.y() * textured.picture.height());
    for (float& value : color) value = srgb_decode(value);
    return color;
  };
}

}  // namespace roxel
