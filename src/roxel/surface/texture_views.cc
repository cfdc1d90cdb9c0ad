#include "roxel/surface/texture_views.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/color/color_space.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

constexpr std::int64_t kTextureGrain = 512;
constexpr std::uint8_t kUsable = 128;
constexpr double kBorder = 1.5;  ///< pixels next to what is not usable may be mixed with it
constexpr float kTooDark = 0.01f, kTooBright = 0.95f;  ///< light that says nothing of gains
constexpr std::size_t kFewTriangles = 20;

bool in_image(const PinholeCamera& camera, const Vector3d& uvz) {
  return uvz.z() > 0 && uvz.x() >= 0.5 && uvz.y() >= 0.5 && uvz.x() <= camera.intrinsics.width - 0.5 &&
         uvz.y() <= camera.intrinsics.height - 0.5;
}

class Onlooker {
 public:
  Onlooker(const TextureView& view, const MeshRays& rays, const SightOptions& options)
      : view_(view), rays_(rays), options_(options) {}

  /// Pixel position of x where the view sees it.
  std::optional<Eigen::Vector2d> see(const Vector3d& x) const {
    const Vector3d uvz = view_.camera.project(x);
    if (!in_image(view_.camera, uvz) || !usable(uvz)) return {};
    const double away = (x - view_.camera.pose.centre).norm();
    if (!rays_.sees(view_.camera.pose.centre, x, options_.tolerance / away)) return {};
    return uvz.head<2>();
  }

  std::optional<FaceView> look(const Mesh& mesh, std::size_t face) const {
    const auto& [a, b, c] = mesh.triangles[face];
    const Vector3d corner[3] = {mesh.points[a], mesh.points[b], mesh.points[c]};
    const Vector3d middle = (corner[0] + corner[1] + corner[2]) / 3;
    const Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    const Vector3d to_eye = view_.camera.pose.centre - middle;
    if (!(normal.dot(to_eye) > options_.least_cosine * normal.norm() * to_eye.norm())) return {};
    FaceView out;
    float detail = 0;
    Eigen::Vector2d uv[3] = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
    const auto look_at = [&](const Vector3d& x, Eigen::Vector2d& seen_at) {
      const auto seen = see(x);
      if (!seen) return false;
      seen_at = *seen;
      const Rgb color = bilinear(view_.rgb, seen->x(), seen->y());
      for (int k = 0; k < 3; ++k) out.color[k] += color[k] / 4;
      detail += detail_at(*seen) / 4;
      return true;
    };
    Eigen::Vector2d at_middle = Eigen::Vector2d::Zero();
    if (!look_at(middle, at_middle)) return {};
    for (int k = 0; k < 3; ++k)
      if (!look_at(0.9 * corner[k] + 0.1 * middle, uv[k])) return {};
    const Eigen::Vector2d p = uv[1] - uv[0], q = uv[2] - uv[0];
    const auto pixels = static_cast<float>(0.5 * std::abs(p.x() * q.y() - p.y() * q.x()) / (0.9 * 0.9));
    out.quality = pixels;
    out.detail = detail;
    return out;
  }

 private:
  bool usable(const Vector3d& uvz) const {
    if (view_.usable.empty()) return true;
    const auto at = [&](double u, double v) {
      return view_.usable.at(std::clamp(static_cast<int>(u), 0, view_.usable.width() - 1),
                             std::clamp(static_cast<int>(v), 0, view_.usable.height() - 1)) >= kUsable;
    };
    return at(uvz.x(), uvz.y()) && at(uvz.x() - kBorder, uvz.y()) && at(uvz.x() + kBorder, uvz.y()) &&
           at(uvz.x(), uvz.y() - kBorder) && at(uvz.x(), uvz.y() + kBorder);
  }

  /// How much display values change from pixel to pixel.
  float detail_at(const Eigen::Vector2d& uv) const {
    const auto shade = [&](double u, double v) {
      const Rgb color = bilinear(view_.rgb, u, v);
      return srgb_encode(std::clamp(0.2f * color[0] + 0.7f * color[1] + 0.1f * color[2], 0.0f, 1.0f));
    };
    const float dx = shade(uv.x() + 1, uv.y()) - shade(uv.x() - 1, uv.y());
    const float dy = shade(uv.x(), uv.y() + 1) - shade(uv.x(), uv.y() - 1);
    return 0.5f * std::hypot(dx, dy);
  }

  const TextureView& view_;
  const MeshRays& rays_;
  const SightOptions& options_;
};

TextureView checked(TextureView view) {
  ROXEL_CHECK_EQ(view.rgb.width(), view.camera.intrinsics.width);
  ROXEL_CHECK_EQ(view.rgb.height(), view.camera.intrinsics.height);
  ROXEL_CHECK_EQ(view.rgb.channels(), 3);
  return view;
}

/// Calls visit(v, view) for all views in order.
template <class Visit>
void for_each_view(int view_count, const TextureViewLoader& load, int views_held, const RunContext& context,
                   const Visit& visit) {
  const auto loaded = [&](std::int64_t v) {
    context.throw_if_cancelled();
    return checked(load(static_cast<int>(v)));
  };
  for_each_prepared(view_count, views_held, context.thread_count(), loaded,
                    [&](std::int64_t v, const TextureView& view) { visit(static_cast<int>(v), view); });
}

Rgb mean_color(const Surface& surface, std::size_t face) {
  Rgb mean{};
  for (const std::uint32_t corner : surface.mesh.triangles[face])
    for (int c = 0; c < 3; ++c) mean[c] += surface.colors[corner][c] / 3;
  return mean;
}

}  // namespace

Rgb bilinear(const Image& image, double u, double v) {
  const double x = std::clamp(u - 0.5, 0.0, image.width() - 1.0),
               y = std::clamp(v - 0.5, 0.0, image.height() - 1.0);
  const int x0 = std::min(static_cast<int>(x), image.width() - 1),
            y0 = std::min(static_cast<int>(y), image.height() - 1);
  const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
  const auto s = static_cast<float>(x - x0), t = static_cast<float>(y - y0);
  const float *a = image.pixel(x0, y0), *b = image.pixel(x1, y0), *c = image.pixel(x0, y1),
              *d = image.pixel(x1, y1);
  Rgb out;
  for (int k = 0; k < 3; ++k)
    out[k] = (1 - t) * ((1 - s) * a[k] + s * b[k]) + t * ((1 - s) * c[k] + s * d[k]);
  return out;
}

std::vector<std::vector<FaceView>> face_views(const Mesh& mesh, const MeshRays& rays, int view_count,
                                              const TextureViewLoader& load, const SightOptions& options,
                                              RunContext& context) {
  std::vector<std::vector<FaceView>> out(mesh.triangles.size());
  for_each_view(view_count, load, options.views_held, context, [&](int v, const TextureView& view) {
    const Onlooker onlooker(view, rays, options);
    parallel_for_blocks(std::ssize(out), kTextureGrain, context.thread_count(),
                        [&](std::int64_t begin, std::int64_t end, int) {
                          for (std::int64_t f = begin; f < end; ++f)
                            if (auto seen = onlooker.look(mesh, f)) {
                              seen->view = v;
                              out[f].push_back(*seen);
                            }
                        });
  });
  return out;
}

std::vector<Rgb> photograph_colors(const Surface& surface, const MeshRays& rays, int view_count,
                                   const TextureViewLoader& load, const std::vector<Rgb>& gains,
                                   const std::vector<Rgb>& fallback, const SightOptions& options,
                                   RunContext& context) {
  const std::size_t count = surface.mesh.points.size();
  std::vector<Rgb> sums(count, Rgb{});
  std::vector<float> weights(count);
  for_each_view(view_count, load, options.views_held, context, [&](int v, const TextureView& view) {
    const Onlooker onlooker(view, rays, options);
    parallel_for_blocks(std::ssize(sums), kTextureGrain, context.thread_count(),
                        [&](std::int64_t begin, std::int64_t end, int) {
                          for (std::int64_t i = begin; i < end; ++i) {
                            const Vector3d& x = surface.mesh.points[i];
                            const double cosine = surface.normals[i].cast<double>().dot(
                                (view.camera.pose.centre - x).normalized());
                            if (!(cosine > options.least_cosine)) continue;
                            const auto seen = onlooker.see(x);
                            if (!seen) continue;
                            const Rgb color = bilinear(view.rgb, seen->x(), seen->y());
                            const auto weight = static_cast<float>(cosine * cosine);
                            for (int c = 0; c < 3; ++c) sums[i][c] += weight * gains[v][c] * color[c];
                            weights[i] += weight;
                          }
                        });
  });
  for (std::size_t i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c) sums[i][c] = weights[i] > 0 ? sums[i][c] / weights[i] : fallback[i][c];
  return sums;
}

std::vector<Rgb> light_gains(const Surface& surface, const std::vector<std::vector<FaceView>>& views,
                             int view_count) {
  std::vector<std::array<std::vector<float>, 3>> ratios(view_count);
  for (std::size_t f = 0; f < views.size(); ++f) {
    const Rgb wanted = mean_color(surface, f);
    for (const FaceView& seen : views[f])
      for (int c = 0; c < 3; ++c)
        if (std::min(seen.color[c], wanted[c]) > kTooDark && seen.color[c] < kTooBright)
          ratios[seen.view][c].push_back(wanted[c] / seen.color[c]);
  }
  std::vector<Rgb> gains(view_count, Rgb{1, 1, 1});
  for (int v = 0; v < view_count; ++v)
    for (int c = 0; c < 3; ++c) {
      std::vector<float>& values = ratios[v][c];
      if (values.size() < kFewTriangles) continue;
      std::nth_element(values.begin(), values.begin() + std::ssize(values) / 2, values.end());
      gains[v][c] = values[values.size() / 2];
    }
  return gains;
}

}  // namespace roxel
