#pragma once
/// Textured surfaces as other programs open them: glTF 2.0 binary [glTF], and Wavefront OBJ with MTL.

#include <filesystem>

#include "roxel/surface/texture.h"

namespace roxel {

enum class TextureFormat { kPng, kJpeg };

/// One mesh, one material (KHR_materials_unlit: what photographs show is lit already; programs that do not
/// know it see matte), one picture, all in the file. World coordinates; where floats are too coarse for them,
/// positions are about the surface's middle and the node moves them there. Atomic; throws IoError.
void write_glb(const std::filesystem::path& path, const TexturedSurface& textured, TextureFormat format);

/// path.obj, and beside it the same name with .mtl and .png or .jpg; the OBJ last. Each is atomic; throws
/// IoError.
void write_obj(const std::filesystem::path& path, const TexturedSurface& textured, TextureFormat format);

}  // namespace roxel
