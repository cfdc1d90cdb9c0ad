#include "roxel/sky/perez_fit.h"

#include <gtest/gtest.h>

#include <random>

#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

std::vector<Eigen::Vector3d> dome(double lowest_deg = 2) {
  const FacetSphere sphere(3);
  std::vector<Eigen::Vector3d> directions;
  for (int f = 0; f < sphere.count(); ++f)
    if (sphere.centre(f).z() > std::sin(lowest_deg * kDegree)) directions.push_back(sphere.centre(f));
  return directions;
}

std::vector<SkySample> samples_of(const PerezChannel& channel, const Eigen::Vector3d& sun) {
  std::vector<SkySample> samples;
  for (const Eigen::Vector3d& d : dome())
    samples.push_back({d, Eigen::Vector3d::Constant(channel.scale * perez_relative(channel.shape, d, sun))});
  return samples;
}

double mean_difference(const PerezChannel& a, const PerezChannel& b, const Eigen::Vector3d& sun) {
  double sum = 0;
  for (const Eigen::Vector3d& d : dome())
    sum +=
        std::abs(a.scale * perez_relative(a.shape, d, sun) / (b.scale * perez_relative(b.shape, d, sun)) - 1);
  return sum / static_cast<double>(dome().size());
}

TEST(PerezFit, RecoversKnownSkiesFromNoisySamplesOver100Seeds) {
  // Noise of 2 %, one sample in twelve a wall: the fit over 256 samples is good to a third of the noise.
  for (int seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<>(low, high)(random);
    };
    const Eigen::Vector3d sun = sun_direction({uniform(0, 360), uniform(15, 70)});
    const PerezChannel truth =
        seed % 4 == 0 ? PerezChannel{{uniform(1, 4), uniform(-1, -0.5), 0, -1, 0, 1}, uniform(0.01, 10)}
                      : PerezChannel{{uniform(-1.02, -0.8), uniform(-0.6, -0.15), uniform(2, 25),
                                      uniform(-5, -2.5), uniform(0.1, 1), 1},
                                     uniform(0.01, 10)};
    std::vector<SkySample> samples = samples_of(truth, sun);
    std::normal_distribution<> normal(0, 0.02);
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples[i].radiance *= i % 12 == 5 ? uniform(0.2, 4) : 1 + normal(random);
    PerezFitOptions options;
    options.starts = published_starts(sun);
    const PerezFit fit = fit_perez(samples, 1, sun, options);
    EXPECT_LT(mean_difference(fit.channel, truth, sun), 0.013) << "seed " << seed;
  }
}

TEST(PerezFit, FindsTheParametersThemselvesWithoutNoise) {
  const Eigen::Vector3d sun = sun_direction({200, 45});
  const PerezChannel truth{{-0.95, -0.3, 12, -3.5, 0.5, 1}, 0.3};
  PerezFitOptions options;
  options.starts = published_starts(sun);
  const PerezChannel found = fit_perez(samples_of(truth, sun), 0, sun, options).channel;
  EXPECT_NEAR(found.shape.a, -0.95, 0.005);
  EXPECT_NEAR(found.shape.b, -0.3, 0.01);
  EXPECT_NEAR(found.shape.c, 12, 0.2);
  EXPECT_NEAR(found.shape.d, -3.5, 0.05);
  EXPECT_NEAR(found.shape.e, 0.5, 0.02);
  EXPECT_NEAR(found.scale, 0.3, 0.006);
}

TEST(PerezFit, FreesTheExponentWhenAsked) {
  const Eigen::Vector3d sun = sun_direction({200, 45});
  const PerezChannel truth{{-0.95, -0.3, 20, -4, 0.5, 0.6}, 0.3};
  PerezFitOptions options;
  options.starts = published_starts(sun);
  const PerezFit fixed = fit_perez(samples_of(truth, sun), 0, sun, options);
  options.freedom = PerezFreedom::kExponent;
  const PerezFit free = fit_perez(samples_of(truth, sun), 0, sun, options);
  EXPECT_EQ(fixed.channel.shape.h, 1);
  EXPECT_NEAR(free.channel.shape.h, 0.6, 0.05);
  EXPECT_LT(free.mean_error, 0.3 * fixed.mean_error);
}

TEST(PerezFit, StaysWithinItsBounds) {
  // Brightest opposite to the sun and darkest around it: no Perez sky.
  const Eigen::Vector3d sun = sun_direction({0, 30});
  std::vector<SkySample> samples;
  for (const Eigen::Vector3d& d : dome()) samples.push_back({d, Eigen::Vector3d::Constant(1.2 - d.dot(sun))});
  PerezFitOptions options;
  options.starts = published_starts(sun);
  options.freedom = PerezFreedom::kExponent;
  const PerezChannel found = fit_perez(samples, 2, sun, options).channel;
  EXPECT_LE(found.shape.b, 0);
  EXPECT_LE(found.shape.d, 0);
  EXPECT_GT(found.scale, 0);
  EXPECT_TRUE(std::isfinite(found.shape.a + found.shape.c + found.shape.e + found.shape.h));
}

TEST(PerezFit, GradationAloneDoesNotDependOnTheSun) {
  PerezFitOptions options;
  options.freedom = PerezFreedom::kGradation;
  options.starts = published_starts(Eigen::Vector3d::UnitZ());
  const auto samples = samples_of({{3, -0.8, 0, -1, 0, 1}, 0.7}, Eigen::Vector3d::UnitX());
  const PerezChannel found = fit_perez(samples, 0, Eigen::Vector3d::UnitZ(), options).channel;
  EXPECT_EQ(found.shape.c, 0);
  EXPECT_EQ(found.shape.e, 0);
  EXPECT_NEAR(found.shape.a, 3, 0.05);
}

TEST(PerezFit, OfScaleAloneKeepsAStartAsItIs) {
  const Eigen::Vector3d sun = sun_direction({100, 50});
  PerezFitOptions options;
  options.freedom = PerezFreedom::kScaleOnly;
  options.starts = published_starts(sun);
  const PerezFit found = fit_perez(samples_of({options.starts[5], 2.5}, sun), 0, sun, options);
  EXPECT_EQ(found.start, 5);
  EXPECT_EQ(found.channel.shape, options.starts[5]);
  EXPECT_NEAR(found.channel.scale, 2.5, 1e-9);
}

TEST(PerezFit, APriorSaysWhatNoSampleSays) {
  // Nothing below 30 degrees is seen, and what is seen has unrest.
  const Eigen::Vector3d sun = sun_direction({100, 50});
  const PerezChannel truth{{4, -0.7, 0, -1, 0, 1}, 1};
  std::vector<SkySample> samples;
  for (const Eigen::Vector3d& d : dome(30))
    samples.push_back({d, Eigen::Vector3d::Constant(perez_relative(truth.shape, d, sun) *
                                                    (1 + 0.03 * unrest(static_cast<int>(1000 * d.x()),
                                                                       static_cast<int>(1000 * d.y()))))});
  PerezFitOptions options;
  options.starts = published_starts(sun);
  const double without = mean_difference(fit_perez(samples, 0, sun, options).channel, truth, sun);
  options.prior_strength = 2e-5;
  const double with = mean_difference(fit_perez(samples, 0, sun, options).channel, truth, sun);
  EXPECT_LT(with, 0.5 * without);
}

TEST(PerezFit, WithoutSamplesOrStartsIsAnError) {
  PerezFitOptions options;
  EXPECT_THROW(fit_perez(samples_of({{}, 1}, Eigen::Vector3d::UnitZ()), 0, Eigen::Vector3d::UnitZ(), options),
               std::logic_error);
  options.starts = {PerezShape{}};
  EXPECT_THROW(fit_perez({}, 0, Eigen::Vector3d::UnitZ(), options), std::logic_error);
}

}  // namespace
}  // namespace roxel
