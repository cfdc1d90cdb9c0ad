#include "roxel/io/dataset_writer.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "roxel/base/error.h"
#include "roxel/io/dataset_fixture.h"
#include "roxel/io/dataset_reader.h"

namespace roxel {
namespace {

using namespace fixture;

/// A number of [-1, 1] from any whole number.
double unit(int n) { return std::sin(0.7 * n + 0.1); }

/// A set under `folder` with a different pose, lens, node, time and range in every view; files exist.
Dataset make_dataset(const fs::path& folder, const std::vector<int>& numbers) {
  Dataset dataset;
  dataset.path = folder.string();
  int i = 0;
  for (int n : numbers) {
    View view;
    view.name = "v" + std::to_string(i);
    view.image_path = (folder / "images" / (view.name + ".png")).string();
    write_image(view.image_path, 32, 24);
    if (i % 2) {
      view.mask_path = (folder / "masks" / (view.name + ".png")).string();
      write_image(view.mask_path, 32, 24);
    }
    view.camera.pose.rotation =
        Eigen::AngleAxisd(3 * unit(n), Eigen::Vector3d(unit(n + 1), unit(n + 2), 1.5).normalized())
            .toRotationMatrix();
    view.camera.pose.centre = 100 * Eigen::Vector3d(unit(n + 3), unit(n + 4), unit(n + 5));
    view.lens.intrinsics = {32, 24, 30 + unit(n + 6), 31 + unit(n + 7), 16 + unit(n + 8), 12 + unit(n + 9),
                            0};
    if (i % 3 == 1) {
      view.lens.model = LensModel::kOpenCv;
      view.lens.coefficients = {0.01 * unit(n), 0.01 * unit(n + 1), 0.001 * unit(n + 2), 0.001 * unit(n + 3)};
    }
    view.near = 1.5 + unit(n);
    view.far = 4 + unit(n);
    view.node_id = i / 2;
    view.time_utc_s = 1e9 + n % 1000 + 0.25;
    view.latitude_deg = 80 * unit(n);
    view.longitude_deg = 170 * unit(n);
    dataset.views.push_back(view);
    ++i;
  }
  for (int n = 0; n < 5; ++n) dataset.points.emplace_back(unit(n), unit(n + 1), unit(n + 2));
  return dataset;
}

void expect_same_cameras(const Dataset& read, const Dataset& written) {
  ASSERT_EQ(read.views.size(), written.views.size());
  for (std::size_t i = 0; i < read.views.size(); ++i) {
    const View& a = read.views[i];
    const View& b = written.views[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.image_path, b.image_path);
    EXPECT_EQ(a.mask_path, b.mask_path);
    EXPECT_LT((a.camera.pose.rotation - b.camera.pose.rotation).norm(), 1e-12);
    EXPECT_LT((a.camera.pose.centre - b.camera.pose.centre).norm(), 1e-9);
    EXPECT_EQ(a.lens.model, b.lens.model);
    EXPECT_EQ(a.lens.coefficients, b.lens.coefficients);
    EXPECT_EQ(a.lens.intrinsics.matrix(), b.lens.intrinsics.matrix());
  }
}

RC_GTEST_PROP(DatasetWriter, TransformsComeBackAsWritten, ()) {
  const TempFolder folder;
  const std::vector<int> numbers = *rc::gen::container<std::vector<int>>(4, rc::gen::inRange(0, 100000));
  Dataset written = make_dataset(folder.path(), numbers);
  written.scene_bounds =
      Eigen::AlignedBox3d(Eigen::Vector3d(-0.1, -0.2, -0.3), Eigen::Vector3d(1.1, 2.2, 3.3));
  write_transforms(written, folder.path());
  const Dataset read = read_dataset(folder.path());
  expect_same_cameras(read, written);
  for (std::size_t i = 0; i < read.views.size(); ++i) {
    RC_ASSERT(read.views[i].node_id == written.views[i].node_id);
    RC_ASSERT(read.views[i].time_utc_s == written.views[i].time_utc_s);
    RC_ASSERT(read.views[i].latitude_deg == written.views[i].latitude_deg);
    RC_ASSERT(read.views[i].longitude_deg == written.views[i].longitude_deg);
    RC_ASSERT(read.views[i].near == written.views[i].near);
    RC_ASSERT(read.views[i].far == written.views[i].far);
  }
  RC_ASSERT(read.nodes.size() == 2u);
  RC_ASSERT(read.scene_bounds->min() == written.scene_bounds->min());
  RC_ASSERT(read.scene_bounds->max() == written.scene_bounds->max());
}

RC_GTEST_PROP(DatasetWriter, ColmapComesBackAsWritten, ()) {
  const TempFolder folder;
  const std::vector<int> numbers = *rc::gen::container<std::vector<int>>(4, rc::gen::inRange(0, 100000));
  const Dataset written = make_dataset(folder.path(), numbers);
  write_colmap_text(written, folder.path());
  const Dataset read = read_dataset(folder.path());
  expect_same_cameras(read, written);
  RC_ASSERT(read.points == written.points);
  RC_ASSERT(read.point_view_counts.empty());
}

TEST(DatasetWriter, BothFormatsAgree) {
  const TempFolder folder;
  const Dataset written = make_dataset(folder.path(), {1, 2, 3});
  write_colmap_text(written, folder.path());
  write_transforms(written, folder.path());
  const Dataset read = read_dataset(folder.path());
  EXPECT_EQ(read.format, "transforms");
  EXPECT_EQ(read.points, written.points);
}

TEST(DatasetWriter, OtherLensesComeBack) {
  const LensModel models[] = {LensModel::kRadial, LensModel::kFullOpenCv, LensModel::kOpenCvFisheye,
                              LensModel::kThinPrismFisheye, LensModel::kFov};
  for (LensModel model : models) {
    SCOPED_TRACE(static_cast<int>(model));
    const TempFolder folder;
    Dataset written = make_dataset(folder.path(), {5});
    written.views[0].lens.model = model;
    written.views[0].lens.intrinsics.fy = written.views[0].lens.intrinsics.fx;
    written.views[0].lens.coefficients = {0.011, 0, 0, 0, 0, 0, 0, 0};
    if (model == LensModel::kFullOpenCv || model == LensModel::kThinPrismFisheye) {
      written.views[0].lens.coefficients = {0.011, 0.02, 0.001, 0.002, 0.003, 0.004, 0.0005, 0.0006};
    }
    write_transforms(written, folder.path());
    expect_same_cameras(read_dataset(folder.path()), written);
    fs::remove(folder.path() / "transforms.json");
    write_colmap_text(written, folder.path());
    expect_same_cameras(read_dataset(folder.path()), written);
  }
}

TEST(DatasetWriter, ColmapRefusesWhatItCannotHold) {
  const TempFolder folder;
  Dataset skewed = make_dataset(folder.path(), {1});
  skewed.views[0].lens.intrinsics.skew = 0.5;
  EXPECT_THROW(write_colmap_text(skewed, folder.path()), InvalidInput);
  Dataset elsewhere = make_dataset(folder.path(), {1});
  elsewhere.views[0].image_path = (folder.path() / "v0.png").string();
  EXPECT_THROW(write_colmap_text(elsewhere, folder.path()), InvalidInput);
  Dataset two_focal_lengths = make_dataset(folder.path(), {1});
  two_focal_lengths.views[0].lens.model = LensModel::kSimpleRadial;
  EXPECT_THROW(write_colmap_text(two_focal_lengths, folder.path()), InvalidInput);
  EXPECT_FALSE(fs::exists(folder.path() / "sparse"));
}

}  // namespace
}  // namespace roxel
