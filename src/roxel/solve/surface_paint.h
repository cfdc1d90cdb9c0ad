#pragma once
/// Paints a volume with the colours that its surfaces have without shading and shadow (docs/light.md).

#include "roxel/infer/run_pass.h"
#include "roxel/solve/scene.h"
#include "roxel/solve/surface_light.h"

namespace roxel {

/// `nodes` hold linear RGB over `scene`'s exposure with no light divided out (SampleColors::kRadiance), and
/// `pass` is for that space. Sets the volume's colour channels in the scene's space, and returns the light
/// on its surfaces. Of nodes without a known sky the light counts as 1. The same for any number of threads.
SurfaceLight paint_without_daylight(const Dataset& dataset, const Scene& scene, const Daylight& daylight,
                                    const std::vector<SampleNode>& nodes, const PassOptions& pass,
                                    float least_opacity, const RunContext& context, Volume& volume);

/// What a view's photograph is to be divided by, pixel by pixel: the mean light on what its rays end in; 0
/// where they end in no surface. `sky` as of Daylight::sky_of_views.
Image light_of_pixels(const LatticeStack& stack, const SurfaceLight& light, int sky,
                      const PinholeCamera& camera, Stretch range, const RunContext& context);

/// Light of every slot under a sky, and colours in it: linear RGB, one a slot.
std::vector<Rgb> in_light_of(const SurfaceLight& light, int sky, std::vector<Rgb> colors);

}  // namespace roxel
