#include "roxel/io/ply_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"
#include "roxel/base/test_data.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Mesh read(const std::string& content) {
  const TempFolder folder;
  std::ofstream(folder / "test.ply", std::ios::binary) << content;
  return read_ply(folder / "test.ply");
}

std::string message_of(const std::string& content) {
  try {
    read(content);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "no error";
}

const char* const kVertex = "property float x\nproperty float y\nproperty float z\n";
const std::string kSquare =
    std::string("ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\n") + kVertex +
    "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0.5 9\n4 0 1 2 3\n";

TEST(PlyFile, PolygonsBecomeFansOfTriangles) {
  const Mesh mesh = read(kSquare);
  ASSERT_EQ(mesh.points.size(), 4);
  EXPECT_EQ(mesh.points[3], Eigen::Vector3d(0, 1, 0.5));
  using Triangle = std::array<std::uint32_t, 3>;
  EXPECT_THAT(mesh.triangles, testing::ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
}

template <class T>
std::string bytes_of(T value, bool big_endian) {
  std::string bytes(sizeof value, 0);
  std::memcpy(bytes.data(), &value, sizeof value);
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string binary_triangle(bool big) {
  std::string file =
      std::string("ply\nformat binary_") + (big ? "big" : "little") +
      "_endian 1.0\nelement vertex 3\nproperty double x\nproperty float quality\nproperty float "
      "y\nproperty short z\nelement face 1\nproperty list uchar float other\nproperty list uchar "
      "ushort vertex_index\nend_header\n";
  for (const double x : {0.25, 1.5, -7.0})
    file += bytes_of(x, big) + bytes_of(9.0f, big) + bytes_of(static_cast<float>(2 * x), big) +
            bytes_of(std::int16_t{-3}, big);
  file += bytes_of(std::uint8_t{2}, big) + bytes_of(1.0f, big) + bytes_of(2.0f, big);
  file += bytes_of(std::uint8_t{3}, big);
  for (const std::uint16_t i : {2, 0, 1}) file += bytes_of(i, big);
  return file;
}

TEST(PlyFile, BinaryOfEitherByteOrderIsRead) {
  for (const bool big : {false, true}) {
    const Mesh mesh = read(binary_triangle(big));
    ASSERT_EQ(mesh.points.size(), 3);
    EXPECT_EQ(mesh.points[1], Eigen::Vector3d(1.5, 3, -3));
    ASSERT_EQ(mesh.triangles.size(), 1);
    EXPECT_EQ(mesh.triangles[0], (std::array<std::uint32_t, 3>{2, 0, 1}));
  }
}

TEST(PlyFile, WithoutFacesItIsAPointSet) {
  const Mesh mesh =
      read(std::string("ply\nformat ascii 1.0\nelement vertex 2\n") + kVertex + "end_header\n1 2 3\n4 5 6\n");
  EXPECT_TRUE(mesh.is_point_set());
  EXPECT_EQ(mesh.points.size(), 2);
}

TEST(PlyFile, ElementsWithoutPropertiesTakeNoTime) {
  const Mesh mesh =
      read(std::string("ply\nformat ascii 1.0\nelement nothing 4000000000\nelement vertex 1\n") + kVertex +
           "end_header\n1 2 3\n");
  EXPECT_EQ(mesh.points.size(), 1);
}

TEST(PlyFile, ErrorsSayWhereAndWhat) {
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 1\n";
  EXPECT_THAT(message_of(""), HasSubstr("test.ply"));
  EXPECT_THAT(message_of("hello\nworld\n"), HasSubstr("expected a PLY file"));
  EXPECT_THAT(message_of("ply\nformat xml 1.0\n"), HasSubstr(":2: found 'xml', expected ascii"));
  EXPECT_THAT(message_of(head + "property float16 x\n"), HasSubstr(":4: found 'float16'"));
  EXPECT_THAT(message_of(head + kVertex), HasSubstr(":7: found the end of the file, expected end_header"));
  EXPECT_THAT(message_of(head + "property float x\nproperty float y\nend_header\n1 2\n"),
              HasSubstr("without z"));
  EXPECT_THAT(message_of(head + kVertex + "end_header\n1 2\n"), HasSubstr("the end of the file, expected z"));
  EXPECT_THAT(message_of(head + kVertex + "end_header\n1 two 3\n"), HasSubstr(":8: y: found 'two'"));
  EXPECT_THAT(message_of(head + kVertex + "end_header\n1 nan 3\n"), HasSubstr(":8: y"));
  EXPECT_THAT(message_of("ply\nformat ascii 1.0\nend_header\n"), HasSubstr("no vertices"));
  EXPECT_THAT(message_of("ply\nelement vertex 1\nend_header\n"), HasSubstr("without a format"));
  std::string far = kSquare;
  far.replace(far.find("4 0 1 2 3"), 9, "4 0 1 2 4");
  EXPECT_THAT(message_of(far), HasSubstr("vertex 4, expected vertices 0 to 3"));
  const std::string binary = binary_triangle(false);
  EXPECT_THAT(message_of(binary.substr(0, binary.size() - 1)), HasSubstr(": byte "));
  EXPECT_THAT(message_of("ply\nformat ascii 1.0\nelement vertex 4000000000\n" + std::string(kVertex) +
                         "end_header\n1 2 3\n"),
              HasSubstr("6 bytes (cut off?), expected 4000000000 of element vertex"));
  EXPECT_THROW(read_ply(TempFolder() / "missing.ply"), InvalidInput);
}

TEST(PlyFile, ReadsTheTruthOfTheHead) {
  ROXEL_TEST_DATA_OR_SKIP(path, "head/mesh.ply");
  const Mesh mesh = read_ply(path);
  EXPECT_EQ(mesh.points.size(), 54682);
  EXPECT_EQ(mesh.triangles.size(), 109352);
}

}  // namespace
}  // namespace roxel
