#pragma once
/// Rays compose (docs/rays.md): what a stretch of a ray does to the rest of it is a pair of numbers with an
/// associative product, so a ray may be cut at fixed planes and computed in pieces, anywhere, and folded
/// again.

namespace roxel {

/// Transmittance T in [0, 1] and summed likelihood Z = sum of T_s a_s p_s, both seen from the segment's
/// start.
struct Segment {
  float transmittance = 1;
  float likelihood = 0;

  /// (T1, Z1) (T2, Z2) = (T1 T2, Z1 + T1 Z2).
  Segment then(const Segment& behind) const {
    return {transmittance * behind.transmittance, likelihood + transmittance * behind.likelihood};
  }
  /// Appends one voxel of opacity a and colour likelihood p.
  void append(float a, float p) {
    likelihood += transmittance * a * p;
    transmittance *= 1 - a;
  }
};

}  // namespace roxel
