#pragma once
/// Rectangles packed into one picture. Debian has no library for this; since charts are projections into
/// photographs, all that is needed is a skyline: each rectangle goes where its top ends lowest [Jylanki10].

#include <cstdint>
#include <vector>

namespace roxel {

struct AtlasRect {
  int width = 0, height = 0;  ///< pixels
  int x = 0, y = 0;           ///< its place: the top left corner
};

struct AtlasSize {
  int width = 0, height = 0;
};

/// Places all rectangles, without overlap, tallest first, in a picture of that width and as high as it takes.
/// Every rectangle must fit the width.
AtlasSize pack(int width, std::vector<AtlasRect>& rects);

}  // namespace roxel
