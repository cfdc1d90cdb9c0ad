#pragma once
/// From a View to its pixels: reads the file, decodes its response, undoes the lens, and reads the mask.

#include <optional>

#include "roxel/color/response.h"
#include "roxel/dataset/dataset.h"

namespace roxel {

enum class MaskUse {
  kAuto,  ///< the view's mask file; without one the image's alpha, where that is not 255 everywhere
  kNone,  ///< no foreground mask, whatever there is
};

struct PhotographOptions {
  std::optional<Response> response;  ///< of every image; default: by file type (see read_image)
  MaskUse masks = MaskUse::kAuto;
};

/// The loader may be called from several threads at once. It throws InvalidInput, naming the file and the
/// view's `source`, when an image or mask cannot be read, is of another size than the view's lens, or has no
/// pixel left once the lens is undone. Pixels that are not finite in the file are 0 in `valid`.
PhotographLoader make_photograph_loader(const PhotographOptions& options = {});

}  // namespace roxel
