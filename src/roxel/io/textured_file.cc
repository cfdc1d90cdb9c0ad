#include "roxel/io/textured_file.h"

#include <tiny_gltf.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/io/image_bytes.h"
#include "roxel/io/surface_ply.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

constexpr int kJpegQuality = 92;

std::string picture_bytes(const Image& picture, TextureFormat format) {
  return format == TextureFormat::kPng ? png_bytes(picture) : jpeg_bytes(picture, kJpegQuality);
}

void write_bytes(const fs::path& path, const std::string& bytes) {
  write_file_atomically(path, [&](const fs::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!file.flush()) throw IoError(path.string() + ": cannot write (disc full?)");
  });
}

/// The point of the surface that each texture coordinate belongs to.
std::vector<std::uint32_t> points_of_uvs(const TexturedSurface& textured) {
  std::vector<std::uint32_t> points(textured.uvs.size());
  for (std::size_t f = 0; f < textured.uv_corners.size(); ++f)
    for (int k = 0; k < 3; ++k) points[textured.uv_corners[f][k]] = textured.surface.mesh.triangles[f][k];
  return points;
}

/// Fills a glTF model with one buffer, view after view, each with its accessor.
class ModelBuilder {
 public:
  ModelBuilder() { model_.buffers.emplace_back(); }

  int add_view(const void* data, std::size_t bytes, int target) {
    std::vector<unsigned char>& all = model_.buffers[0].data;
    all.resize((all.size() + 3) / 4 * 4);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = all.size();
    view.byteLength = bytes;
    view.target = target;
    const auto* begin = static_cast<const unsigned char*>(data);
    all.insert(all.end(), begin, begin + bytes);
    model_.bufferViews.push_back(std::move(view));
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  int add_accessor(int view, int component, int type, std::size_t count) {
    tinygltf::Accessor accessor;
    accessor.bufferView = view;
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = count;
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  int add_vectors(const std::vector<Eigen::Vector3f>& values) {
    const int view = add_view(values.data(), values.size() * sizeof values[0], TINYGLTF_TARGET_ARRAY_BUFFER);
    return add_accessor(view, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, values.size());
  }

  tinygltf::Model& model() { return model_; }

 private:
  tinygltf::Model model_;
};

void add_bounds(const std::vector<Eigen::Vector3f>& values, tinygltf::Accessor& accessor) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& x : values) box.extend(x);
  for (int axis = 0; axis < 3; ++axis) {
    accessor.minValues.push_back(box.min()[axis]);
    accessor.maxValues.push_back(box.max()[axis]);
  }
}

void add_material(ModelBuilder& builder, const std::string& picture, TextureFormat format) {
  tinygltf::Model& model = builder.model();
  tinygltf::Image image;
  image.bufferView = builder.add_view(picture.data(), picture.size(), 0);
  image.mimeType = format == TextureFormat::kPng ? "image/png" : "image/jpeg";
  model.images.push_back(std::move(image));
  tinygltf::Sampler sampler;
  sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
  sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
  sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
  model.samplers.push_back(std::move(sampler));
  tinygltf::Texture texture;
  texture.sampler = 0;
  texture.source = 0;
  model.textures.push_back(std::move(texture));
  tinygltf::Material material;
  material.name = "photographs";
  material.pbrMetallicRoughness.baseColorTexture.index = 0;
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 1;
  material.doubleSided = true;
  material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object{});
  model.materials.push_back(std::move(material));
  model.extensionsUsed.push_back("KHR_materials_unlit");
}

tinygltf::Primitive add_geometry(ModelBuilder& builder, const TexturedSurface& textured,
                                 const Eigen::Vector3d& middle) {
  const Surface& surface = textured.surface;
  const std::vector<std::uint32_t> points = points_of_uvs(textured);
  std::vector<Eigen::Vector3f> positions, normals;
  for (const std::uint32_t i : points) {
    positions.push_back((surface.mesh.points[i] - middle).cast<float>());
    const Eigen::Vector3f& normal = surface.normals[i];
    normals.push_back(normal.squaredNorm() > 0.5f ? normal : Eigen::Vector3f(0, 0, 1));  // glTF: unit, always
  }
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.material = 0;
  primitive.attributes["POSITION"] = builder.add_vectors(positions);
  add_bounds(positions, builder.model().accessors.back());
  primitive.attributes["NORMAL"] = builder.add_vectors(normals);
  const int uvs = builder.add_view(textured.uvs.data(), textured.uvs.size() * sizeof textured.uvs[0],
                                   TINYGLTF_TARGET_ARRAY_BUFFER);
  primitive.attributes["TEXCOORD_0"] =
      builder.add_accessor(uvs, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC2, textured.uvs.size());
  const int corners =
      builder.add_view(textured.uv_corners.data(), textured.uv_corners.size() * sizeof textured.uv_corners[0],
                       TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  primitive.indices = builder.add_accessor(corners, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                           TINYGLTF_TYPE_SCALAR, 3 * textured.uv_corners.size());
  return primitive;
}

}  // namespace

void write_glb(const fs::path& path, const TexturedSurface& textured, TextureFormat format) {
  ROXEL_CHECK(!textured.surface.mesh.triangles.empty());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  if (floats_are_too_coarse(textured.surface.mesh)) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& x : textured.surface.mesh.points) box.extend(x);
    middle = box.center();
  }
  ModelBuilder builder;
  tinygltf::Mesh mesh;
  mesh.name = "surface";
  mesh.primitives.push_back(add_geometry(builder, textured, middle));
  add_material(builder, picture_bytes(textured.picture, format), format);
  tinygltf::Model& model = builder.model();
  model.asset.version = "2.0";
  model.asset.generator = "roxel";
  model.meshes.push_back(std::move(mesh));
  tinygltf::Node node;
  node.mesh = 0;
  if (middle != Eigen::Vector3d::Zero()) node.translation.assign(middle.data(), middle.data() + 3);
  model.nodes.push_back(std::move(node));
  tinygltf::Scene scene;
  scene.nodes.push_back(0);
  model.scenes.push_back(std::move(scene));
  model.defaultScene = 0;
  std::ostringstream bytes;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&model, bytes, false, true))
    throw IoError(path.string() + ": cannot be made");
  write_bytes(path, bytes.str());
}

void write_obj(const fs::path& path, const TexturedSurface& textured, TextureFormat format) {
  const Surface& surface = textured.surface;
  fs::path picture = path, materials = path;
  picture.replace_extension(format == TextureFormat::kPng ? ".png" : ".jpg");
  materials.replace_extension(".mtl");
  std::string text = "# roxel: surface\nmtllib " + materials.filename().string() + "\nusemtl photographs\n";
  for (const Eigen::Vector3d& x : surface.mesh.points)
    text += formatted("v %.9g %.9g %.9g\n", x.x(), x.y(), x.z());
  for (const Eigen::Vector2f& uv : textured.uvs) text += formatted("vt %.7g %.7g\n", uv.x(), 1 - uv.y());
  for (const Eigen::Vector3f& n : surface.normals)
    text += formatted("vn %.5g %.5g %.5g\n", n.x(), n.y(), n.z());
  for (std::size_t f = 0; f < surface.mesh.triangles.size(); ++f) {
    text += "f";
    for (int k = 0; k < 3; ++k) {
      const unsigned point = surface.mesh.triangles[f][k] + 1;
      text += formatted(" %u/%u/%u", point, textured.uv_corners[f][k] + 1, point);
    }
    text += "\n";
  }
  write_bytes(picture, picture_bytes(textured.picture, format));
  write_bytes(materials, "newmtl photographs\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 0\nmap_Kd " +
                             picture.filename().string() + "\n");
  write_bytes(path, text);
}

}  // namespace roxel
