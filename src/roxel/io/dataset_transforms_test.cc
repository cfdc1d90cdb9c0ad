#include "roxel/io/dataset_transforms.h"

#include <gmock/gmock.h>

#include <cmath>

#include "roxel/io/dataset_fixture.h"
#include "roxel/io/dataset_reader.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

using namespace fixture;

const char* const kIdentity = "\"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

/// A set with one image, images/a.png, 32 x 24; `keys` goes into its frame.
Dataset read_one(const std::string& keys, const std::string& shared = "",
                 const std::string& file_path = "images/a.png") {
  const TempFolder set;
  write_image(set.path() / "images/a.png", 32, 24);
  write_file(set.path() / "transforms.json", "{" + shared + "\"frames\": [{\"file_path\": \"" + file_path +
                                                 "\", " + keys + kIdentity + "}]}");
  return read_dataset(set.path());
}

TEST(Transforms, OpenGlCameraLooksAlongMinusZWithYUp) {
  const View view = read_one("\"fl_x\": 40, ").views[0];
  const Eigen::Vector3d ahead = view.camera.project({0, 0, -2});
  EXPECT_DOUBLE_EQ(ahead.x(), 16);
  EXPECT_DOUBLE_EQ(ahead.y(), 12);
  EXPECT_DOUBLE_EQ(ahead.z(), 2);
  const Eigen::Vector3d up_right = view.camera.project({0.1, 0.2, -2});
  EXPECT_DOUBLE_EQ(up_right.x(), 18) << "right is right";
  EXPECT_DOUBLE_EQ(up_right.y(), 8) << "up is up: a smaller row";
}

TEST(Transforms, AngleGivesTheFocalLength) {
  const double angle = 2 * std::atan(16.0 / 40.0);
  const Intrinsics k = read_one("", "\"camera_angle_x\": " + digits(angle) + ", ").views[0].camera.intrinsics;
  EXPECT_NEAR(k.fx, 40, 1e-12);
  EXPECT_NEAR(k.fy, 40, 1e-12);
  EXPECT_EQ(k.cx, 16);
  EXPECT_EQ(k.cy, 12);
  EXPECT_EQ(k.width, 32);
}

TEST(Transforms, FrameOverridesWhatIsShared) {
  const Intrinsics k = read_one("\"fl_x\": 50, \"cy\": 11, ", "\"fl_x\": 40, \"fl_y\": 41, \"cx\": 15, ")
                           .views[0]
                           .camera.intrinsics;
  EXPECT_EQ(k.fx, 50);
  EXPECT_EQ(k.fy, 41);
  EXPECT_EQ(k.cx, 15);
  EXPECT_EQ(k.cy, 11);
}

TEST(Transforms, SuffixMayBeLeftOut) {
  const View view = read_one("\"fl_x\": 40, ", "", "./images/a").views[0];
  EXPECT_EQ(view.name, "a");
  EXPECT_TRUE(view.image_path.ends_with("images/a.png"));
}

TEST(Transforms, NamesCountFromTheFolderWhereImagesLieApart) {
  const TempFolder set;
  write_image(set.path() / "train/r_0.png", 32, 24);
  write_image(set.path() / "test/r_0.png", 32, 24);
  write_file(set.path() / "transforms.json",
             std::string("{\"camera_angle_x\": 0.7, \"frames\": [{\"file_path\": \"./train/r_0\", ") +
                 kIdentity + "}, {\"file_path\": \"./test/r_0\", " + kIdentity + "}]}");
  const Dataset dataset = read_dataset(set.path());
  EXPECT_EQ(dataset.views[0].name, "train/r_0");
  EXPECT_EQ(dataset.views[1].name, "test/r_0");
}

TEST(Transforms, LensModelFollowsTheCoefficients) {
  const std::string f = "\"fl_x\": 40, ";
  EXPECT_EQ(read_one(f + "\"k1\": 0, ").views[0].lens.model, LensModel::kPinhole);
  EXPECT_EQ(read_one(f + "\"k1\": 0.1, ").views[0].lens.model, LensModel::kSimpleRadial);
  EXPECT_EQ(read_one(f + "\"k2\": 0.1, ").views[0].lens.model, LensModel::kRadial);
  const Lens opencv = read_one(f + "\"k1\": 0.1, \"k2\": 0.02, \"p1\": 0.003, \"p2\": 0.004, ").views[0].lens;
  EXPECT_EQ(opencv.model, LensModel::kOpenCv);
  EXPECT_EQ(opencv.coefficients, (std::array<double, 8>{0.1, 0.02, 0.003, 0.004}));
  const Lens third = read_one(f + "\"camera_model\": \"OPENCV\", \"k1\": 0.1, \"k3\": 0.01, ").views[0].lens;
  EXPECT_EQ(third.model, LensModel::kFullOpenCv);
  EXPECT_EQ(third.coefficients, (std::array<double, 8>{0.1, 0, 0, 0, 0.01}));
  const Lens fisheye =
      read_one(
          f +
          "\"camera_model\": \"OPENCV_FISHEYE\", \"k1\": 0.1, \"k2\": 0.02, \"k3\": 0.003, \"k4\": 0.004, ")
          .views[0]
          .lens;
  EXPECT_EQ(fisheye.model, LensModel::kOpenCvFisheye);
  EXPECT_EQ(fisheye.coefficients, (std::array<double, 8>{0.1, 0.02, 0.003, 0.004}));
}

TEST(Transforms, OwnKeysAreRead) {
  const Dataset dataset = read_one(
      "\"fl_x\": 40, \"node\": 7, \"time_utc\": \"1970-01-02T02:00:00.5+01:30\", \"latitude\": -33.5, "
      "\"near\": 0.5, ",
      "\"longitude\": 151.25, \"far\": 9, \"scene_bounds\": [[-1, -2, -3], [1, 2, 3]], ");
  const View& view = dataset.views[0];
  EXPECT_EQ(view.node_id, 7);
  EXPECT_EQ(view.time_utc_s, 86400 + 1800.5);
  EXPECT_EQ(view.latitude_deg, -33.5);
  EXPECT_EQ(view.longitude_deg, 151.25);
  EXPECT_EQ(view.near, 0.5);
  EXPECT_EQ(view.far, 9);
  ASSERT_TRUE(dataset.scene_bounds.has_value());
  EXPECT_EQ(dataset.scene_bounds->min(), Eigen::Vector3d(-1, -2, -3));
}

TEST(Transforms, TimeAndPlaceMayStandInTheListOfNodes) {
  const std::string nodes =
      "\"lat\": 1, \"nodes\": [{\"node\": 6, \"time_utc\": \"1970-01-03T00:00:00Z\"}, "
      "{\"node\": 7, \"time_utc\": \"1970-01-02T00:00:00Z\", \"lat\": 2, \"near\": 3}], ";
  const View of_node = read_one("\"fl_x\": 40, \"node\": 7, ", nodes).views[0];
  EXPECT_EQ(of_node.time_utc_s, 86400);
  EXPECT_EQ(of_node.latitude_deg, 2);
  EXPECT_FALSE(of_node.near.has_value());
  const View own =
      read_one("\"fl_x\": 40, \"node\": 7, \"time_utc\": \"1970-01-01T00:00:09Z\", ", nodes).views[0];
  EXPECT_EQ(own.time_utc_s, 9);
  EXPECT_EQ(read_one("\"fl_x\": 40, \"node\": 6, ", nodes).views[0].latitude_deg, 1);
  EXPECT_FALSE(read_one("\"fl_x\": 40, \"node\": 8, ", nodes).views[0].time_utc_s.has_value());
  EXPECT_FALSE(read_one("\"fl_x\": 40, ", nodes).views[0].time_utc_s.has_value());
}

TEST(Transforms, MaskPathIsRelativeToTheFile) {
  const TempFolder set;
  write_image(set.path() / "images/a.png", 32, 24);
  write_image(set.path() / "m/b.png", 32, 24);
  write_file(
      set.path() / "transforms.json",
      std::string(
          "{\"fl_x\": 40, \"frames\": [{\"file_path\": \"images/a.png\", \"mask_path\": \"m/b.png\", ") +
          kIdentity + "}]}");
  EXPECT_EQ(read_dataset(set.path()).views[0].mask_path, (set.path() / "m/b.png").string());
  EXPECT_EQ(read_dataset(set.path() / "transforms.json").views[0].mask_path,
            (set.path() / "m/b.png").string());
}

TEST(UtcTime, ReadsZonesAndWritesUtc) {
  EXPECT_EQ(parse_utc_time("1970-01-01T00:00:00Z", "here"), 0);
  EXPECT_EQ(parse_utc_time("2000-03-01T00:00:00Z", "here"), 951868800);  // after a leap day
  EXPECT_EQ(parse_utc_time("2000-03-01 01:30+0130", "here"), 951868800);
  EXPECT_EQ(parse_utc_time("2000-02-29T22:00:00-02", "here"), 951868800);
  for (double seconds : {0.0, 951868800.0, 1061484600.25, -86400.5}) {
    EXPECT_EQ(parse_utc_time(format_utc_time(seconds), "here"), seconds) << format_utc_time(seconds);
  }
  for (const char* bad : {"2000-03-01T00:00:00", "2000-03-01", "01.03.2000", "2000-13-01T00:00:00Z",
                          "2000-03-01T24:00:00Z", "2000-03-01T00:00:00Zulu", "2000-03-01T00:00:00+1", ""}) {
    EXPECT_THROW(parse_utc_time(bad, "here"), std::exception) << bad;
  }
}

TEST(DatasetText, EscapesWhatIsNotUtf8) {
  EXPECT_EQ(escaped("caf\xc3\xa9"), "caf\xc3\xa9");
  EXPECT_EQ(escaped("caf\xe9.png"), "caf\\xe9.png");
  EXPECT_EQ(escaped("a\nb"), "a\\x0ab");
  EXPECT_TRUE(is_valid_utf8("\xf0\x9f\x8f\xa0"));
  for (const char* bad : {"\xc0\xaf", "\xed\xa0\x80", "\xf5\x80\x80\x80", "\xe2\x82", "\x80"}) {
    EXPECT_FALSE(is_valid_utf8(bad));
  }
}

}  // namespace
}  // namespace roxel
