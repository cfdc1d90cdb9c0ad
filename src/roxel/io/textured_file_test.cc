#include "roxel/io/textured_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <fstream>
#include <sstream>

#include "roxel/base/error.h"
#include "roxel/base/full_disc_fixture.h"
#include "roxel/base/temp_folder.h"
#include "roxel/io/image_file.h"
#include "roxel/io/ply_file.h"
#include "roxel/io/surface_ply.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A square of two triangles that lie in two charts: four points, six texture coordinates.
TexturedSurface square(const Eigen::Vector3d& corner = Eigen::Vector3d::Zero()) {
  TexturedSurface out;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}})
    out.surface.mesh.points.push_back(corner + Eigen::Vector3d(x, y, 0.25));
  out.surface.mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  out.surface.normals.assign(4, Eigen::Vector3f::UnitZ());
  out.surface.normals[3].setZero();
  out.surface.colors = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5f, 2, -1}};
  out.picture = Image(8, 4, 3);
  for (std::size_t i = 0; i < out.picture.data().size(); ++i)
    out.picture.data()[i] = static_cast<float>(i % 5) / 4;
  out.uvs = {{0, 0}, {0.5f, 0}, {0, 1}, {0.5f, 0}, {1, 1}, {0.5f, 1}};
  out.uv_corners = {{0, 1, 2}, {3, 4, 5}};
  return out;
}

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

const float* floats(const tinygltf::Model& model, int accessor) {
  const tinygltf::BufferView& view = model.bufferViews[model.accessors[accessor].bufferView];
  return reinterpret_cast<const float*>(model.buffers[view.buffer].data.data() + view.byteOffset);
}

tinygltf::Model read_glb(const fs::path& path) {
  tinygltf::Model model;
  tinygltf::TinyGLTF reader;
  std::string error, warning;
  EXPECT_TRUE(reader.LoadBinaryFromFile(&model, &error, &warning, path.string())) << error;
  EXPECT_EQ(error + warning, "");
  return model;
}

TEST(TexturedFile, GlbHoldsTheSurfaceAndItsPicture) {
  const TempFolder folder;
  const fs::path path = folder / "mesh.glb";
  write_glb(path, square(), TextureFormat::kPng);
  const tinygltf::Model model = read_glb(path);
  ASSERT_EQ(model.meshes.size(), 1u);
  const tinygltf::Primitive& primitive = model.meshes[0].primitives[0];
  const tinygltf::Accessor& positions = model.accessors[primitive.attributes.at("POSITION")];
  EXPECT_EQ(positions.count, 6u);
  EXPECT_THAT(positions.minValues, testing::ElementsAre(0, 0, 0.25));
  EXPECT_THAT(positions.maxValues, testing::ElementsAre(1, 1, 0.25));
  EXPECT_EQ(model.accessors[primitive.indices].count, 6u);
  const float* uv = floats(model, primitive.attributes.at("TEXCOORD_0"));
  EXPECT_EQ(uv[2 * 4], 1.0f);
  const float* normals = floats(model, primitive.attributes.at("NORMAL"));
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(Eigen::Map<const Eigen::Vector3f>(normals + 3 * i).norm(), 1, 1e-6);
  ASSERT_EQ(model.images.size(), 1u);
  EXPECT_EQ(model.images[0].mimeType, "image/png");
  EXPECT_EQ(model.images[0].width, 8);
  EXPECT_EQ(model.images[0].height, 4);
  EXPECT_EQ(model.images[0].image[1], 64);  // a quarter, in the second of four channels
  EXPECT_EQ(model.materials[0].extensions.count("KHR_materials_unlit"), 1u);
  EXPECT_EQ(model.extensionsUsed, std::vector<std::string>{"KHR_materials_unlit"});
  for (const tinygltf::BufferView& view : model.bufferViews) EXPECT_EQ(view.byteOffset % 4, 0u);
  const std::string bytes = content(path);
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 8, 4);
  EXPECT_EQ(length, bytes.size());
}

TEST(TexturedFile, GlbFarFromTheOriginKeepsItsShape) {
  const TempFolder folder;
  const fs::path path = folder / "mesh.glb";
  const Eigen::Vector3d corner(4.5e6, -5.1e6, 100);
  write_glb(path, square(corner), TextureFormat::kJpeg);
  const tinygltf::Model model = read_glb(path);
  EXPECT_EQ(model.images[0].mimeType, "image/jpeg");
  const std::vector<double>& moved = model.nodes[0].translation;
  ASSERT_EQ(moved.size(), 3u);
  const float* position = floats(model, model.meshes[0].primitives[0].attributes.at("POSITION"));
  EXPECT_NEAR(moved[0] + position[3] - corner.x(), 1, 1e-6);
  EXPECT_NEAR(moved[1] + position[1] - corner.y(), 0, 1e-6);
}

TEST(TexturedFile, ObjNamesItsMaterialAndCountsFromOne) {
  const TempFolder folder;
  const fs::path path = folder / "mesh.obj";
  write_obj(path, square(), TextureFormat::kPng);
  const std::string text = content(path);
  EXPECT_THAT(text, HasSubstr("mtllib mesh.mtl\nusemtl photographs\nv 0 0 0.25\n"));
  EXPECT_THAT(text, HasSubstr("vt 0.5 1\n"));  // the picture's top is v = 1 there
  EXPECT_THAT(text, HasSubstr("f 2/4/2 4/5/4 3/6/3\n"));
  EXPECT_THAT(content(path.parent_path() / "mesh.mtl"), HasSubstr("map_Kd mesh.png"));
  EXPECT_EQ(read_image((path.parent_path() / "mesh.png").string()).rgb.width(), 8);
}

TEST(TexturedFile, PlyKeepsPlacesAndColours) {
  const TempFolder folder;
  const fs::path path = folder / "mesh.ply";
  const Surface surface = square().surface;
  write_surface_ply(path, surface);
  const Mesh mesh = read_ply(path);
  EXPECT_EQ(mesh.triangles, surface.mesh.triangles);
  EXPECT_EQ(mesh.points, surface.mesh.points);
  const std::string text = content(path);
  EXPECT_THAT(text, HasSubstr("property float x"));
  const std::string rows = text.substr(text.find("end_header\n") + 11);
  EXPECT_EQ(static_cast<unsigned char>(rows[24]), 255);
  EXPECT_EQ(static_cast<unsigned char>(rows[3 * 27 + 24]), 188);  // sRGB of 0.5
  EXPECT_EQ(static_cast<unsigned char>(rows[3 * 27 + 25]), 255);
  EXPECT_EQ(static_cast<unsigned char>(rows[3 * 27 + 26]), 0);
}

TEST(TexturedFile, PlyFarFromTheOriginIsInDoubles) {
  const TempFolder folder;
  const fs::path path = folder / "mesh.ply";
  const Surface far = square({4.5e6, -5.1e6, 100}).surface;
  EXPECT_TRUE(floats_are_too_coarse(far.mesh));
  write_surface_ply(path, far);
  EXPECT_THAT(content(path), HasSubstr("property double x"));
  EXPECT_EQ(read_ply(path).points, far.mesh.points);
}

TEST(TexturedFile, AFullDiscLeavesOlderFilesAsTheyWere) {
  const TempFolder folder;
  const fs::path here = folder.path();
  const TexturedSurface textured = square();
  for (const char* name : {"mesh.ply", "mesh.glb", "mesh.obj"}) std::ofstream(here / name) << "older";
  {
    const fixture::FileSizeLimit full(16);
    EXPECT_THROW(write_surface_ply(here / "mesh.ply", textured.surface), IoError);
    EXPECT_THROW(write_glb(here / "mesh.glb", textured, TextureFormat::kPng), IoError);
    EXPECT_THROW(write_obj(here / "mesh.obj", textured, TextureFormat::kPng), IoError);
  }
  for (const char* name : {"mesh.ply", "mesh.glb", "mesh.obj"}) EXPECT_EQ(content(here / name), "older");
  EXPECT_EQ(std::distance(fs::directory_iterator(here), fs::directory_iterator()), 3);
}

}  // namespace
}  // namespace roxel
