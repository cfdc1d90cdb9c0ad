#pragma once
/// Voxel colours whose interpolated rendering is nearest to the photographs (docs/color.md): a voxel's mean
/// colour blurs what its neighbours and it show together; least squares take that back.

#include "roxel/dataset/dataset.h"
#include "roxel/solve/scene.h"
#include "roxel/solve/summary.h"
#include "roxel/solve/surface_light.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// Sets `volume.fitted_color` to the colours c that minimise
///
///   sum over pixels of w |photograph - light (sum of r_s c(x_s) + r_bg c_bg)|^2 + lambda |c - mean colour|^2
///
/// with c(x) interpolated (blend_around) and r_s the renderer's (render.h), photographs and renders as a
/// display shows them, to first order. Behind the volume, c_bg is the background where its colour is known,
/// else what the photograph shows. Which pixels: FitPixels. Of what the mean colours miss by far, which is
/// something else than the surface, little is believed. `surface_light` where the light on
/// voxels' own surfaces is known, else null. The same bits for any number of threads. `progress` gets
/// fractions of the fit. Where no pixel shows a voxel, its mean colour stays.
ColorFitRecord fit_colors(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
                          const SurfaceLight* surface_light, const RunContext& context,
                          const std::function<void(double)>& progress, Volume& volume);

}  // namespace roxel
