#include "roxel/io/volume_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <random>

#include "roxel/base/error.h"
#include "roxel/base/full_disc_fixture.h"
#include "roxel/base/temp_folder.h"
#include "roxel/volume/vdb_grids.inl"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class VolumeFileTest : public testing::Test {
 protected:
  // What read_volume says about a file; empty when it reads it.
  static std::string refusal(const fs::path& path) {
    try {
      read_volume(path);
      return "";
    } catch (const InvalidInput& e) {
      return e.what();
    }
  }

  const TempFolder temporary_;
  const fs::path folder_ = temporary_.path();
  const fs::path path_ = folder_ / "volume.vdb";
};

// Scattered voxels in both lattices, with random channels.
Volume random_volume(int voxels = 3000) {
  const auto frames = nested_frames({Eigen::Vector3d(-1, 0.3, 5), Eigen::Vector3d(1.1, 2.2, 7.7)}, 0.07, 1);
  std::mt19937 random(3);
  std::vector<Topology> lattices;
  for (const LatticeFrame& frame : frames) {
    Topology& topology = lattices.emplace_back(frame);
    const Eigen::Vector3i n = frame.size_in_voxels();
    for (int i = 0; i < voxels; ++i)
      topology.insert(Eigen::Vector3i(random() % n.x(), random() % n.y(), random() % n.z()));
  }
  lattices[1].erase_inside(frames[0].box());
  Volume volume(std::move(lattices));
  std::uniform_real_distribution<float> unit;
  for (std::uint32_t s = 0; s < volume.slot_count(); ++s) {
    volume.tau[s] = s % 7 == 0 ? 0 : 16 * unit(random);
    volume.confidence[s] = unit(random);
    volume.color_weight[s] = 10 * unit(random);
    volume.color_mean[s] = {100 * unit(random), 100 * unit(random) - 50, 100 * unit(random) - 50};
    const float x = unit(random), y = unit(random), z = unit(random);
    volume.color_cov[s] = PackedCovariance({x, y, z, 0.9f * std::sqrt(x * y), -0.3f * std::sqrt(x * z), 0});
    volume.support[s] = {unit(random), 1e6f * unit(random)};
  }
  return volume;
}

VolumeInfo some_info() { return {ColorTransform(ColorSpace::kLuv, kWhiteA), 1234.5, "/data/küche 1"}; }

template <class T>
std::string bits(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

void expect_equal(const Volume& a, const Volume& b) {
  EXPECT_EQ(bits(a.tau), bits(b.tau));
  EXPECT_EQ(bits(a.confidence), bits(b.confidence));
  EXPECT_EQ(bits(a.color_weight), bits(b.color_weight));
  EXPECT_EQ(bits(a.color_mean), bits(b.color_mean));
  EXPECT_EQ(bits(a.color_cov), bits(b.color_cov));
  EXPECT_EQ(bits(a.support), bits(b.support));
  ASSERT_EQ(a.lattice_count(), b.lattice_count());
  for (int k = 0; k < a.lattice_count(); ++k) {
    EXPECT_EQ(a.index(k).frame().origin, b.index(k).frame().origin);
    EXPECT_EQ(a.index(k).frame().voxel_size, b.index(k).frame().voxel_size);
    EXPECT_EQ(a.index(k).frame().size_in_bricks, b.index(k).frame().size_in_bricks);
    ASSERT_EQ(a.index(k).bricks().size(), b.index(k).bricks().size());
    for (std::size_t i = 0; i < a.index(k).bricks().size(); ++i) {
      EXPECT_EQ(a.index(k).bricks()[i].coord, b.index(k).bricks()[i].coord);
      EXPECT_EQ(a.index(k).bricks()[i].word, b.index(k).bricks()[i].word);
    }
  }
}

TEST_F(VolumeFileTest, ComesBackBitForBit) {
  const Volume volume = random_volume();
  write_volume(path_, volume, some_info(), SavedLattices::kAll);
  const VolumeFile file = read_volume(path_);
  expect_equal(file.volume, volume);
  EXPECT_EQ(file.info.colors.space(), ColorSpace::kLuv);
  EXPECT_EQ(file.info.colors.white(), kWhiteA);
  EXPECT_EQ(file.info.exposure, 1234.5);
  EXPECT_EQ(file.info.dataset, "/data/küche 1");
}

TEST_F(VolumeFileTest, FittedColoursComeBackAndAreWhatOtherProgramsSee) {
  Volume volume = random_volume();
  write_volume(path_, volume, some_info(), SavedLattices::kAll);
  EXPECT_TRUE(read_volume(path_).volume.fitted_color.empty());
  volume.fitted_color.resize(volume.slot_count());
  for (std::uint32_t s = 0; s < volume.slot_count(); ++s)
    volume.fitted_color[s] = {0.001f * static_cast<float>(s % 700), 0.25f, 3.0f};
  write_volume(path_, volume, some_info(), SavedLattices::kAll);
  const Volume back = read_volume(path_).volume;
  expect_equal(back, volume);
  EXPECT_EQ(back.fitted_color, volume.fitted_color);
}

TEST_F(VolumeFileTest, LeavesSurroundOutUnlessAsked) {
  const Volume volume = random_volume();
  write_volume(path_, volume, some_info());
  const Volume back = read_volume(path_).volume;
  EXPECT_EQ(back.lattice_count(), 1);
  ASSERT_EQ(back.slot_count(), volume.box_slot_count());
  EXPECT_TRUE(std::equal(back.tau.begin(), back.tau.end(), volume.tau.begin()));
}

TEST_F(VolumeFileTest, AVolumeWithoutVoxelsComesBack) {
  const LatticeFrame frame{Eigen::Vector3d(1, 2, 3), 0.5, Eigen::Vector3i(2, 1, 1)};
  write_volume(path_, Volume({Topology(frame)}), some_info());
  const Volume back = read_volume(path_).volume;
  EXPECT_EQ(back.slot_count(), 0u);
  EXPECT_EQ(back.index(0).frame().size_in_bricks, frame.size_in_bricks);
}

// One voxel, computed by hand, as another program sees it.
TEST_F(VolumeFileTest, OtherProgramsSeeOpacityAndLinearColourAtVoxelCentres) {
  Topology topology({Eigen::Vector3d(10, 20, 30), 0.5, Eigen::Vector3i(1, 1, 1)});
  topology.insert({1, 2, 3});
  Volume volume({topology});
  volume.tau[0] = std::log(2.0f);
  const float rgb[3] = {0.25f, 0.5f, 0.75f};
  const ColorTransform luv;
  luv.from_rgb(rgb, volume.color_mean[0].data());
  write_volume(path_, volume, {luv});

  openvdb::io::File file(path_.string());
  file.open();
  const auto opacity = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("opacity"));
  ASSERT_TRUE(opacity);
  EXPECT_EQ(opacity->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(opacity->activeVoxelCount(), 1u);
  EXPECT_EQ(opacity->background(), 0.0f);
  EXPECT_FLOAT_EQ(opacity->tree().getValue({1, 2, 3}), 0.5f);
  EXPECT_EQ(opacity->indexToWorld(openvdb::Coord(1, 2, 3)), openvdb::Vec3d(10.75, 21.25, 31.75));
  const auto color = openvdb::gridPtrCast<openvdb::Vec3SGrid>(file.readGrid("color"));
  ASSERT_TRUE(color);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(color->tree().getValue({1, 2, 3})[c], rgb[c], 1e-5);
}

TEST_F(VolumeFileTest, AFullDiscIsAnErrorAndKeepsWhatWasThere) {
  const Volume volume = random_volume();
  write_volume(path_, volume, some_info());
  const auto whole = fs::file_size(path_);
  for (const double share : {0.05, 0.5, 0.95, 0.999}) {
    const fixture::FileSizeLimit limit(static_cast<rlim_t>(share * static_cast<double>(whole)));
    EXPECT_THROW(write_volume(path_, volume, some_info()), IoError) << share;
  }
  EXPECT_EQ(fs::file_size(path_), whole);
  EXPECT_EQ(refusal(path_), "");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(VolumeFileTest, OpensInOpenVdbsOwnTool) {
  if (std::system("command -v vdb_print > /dev/null 2>&1") != 0) GTEST_SKIP() << "vdb_print is not installed";
  write_volume(path_, random_volume(), some_info(), SavedLattices::kAll);
  FILE* pipe = popen(("vdb_print -l '" + path_.string() + "' 2>&1").c_str(), "r");
  ASSERT_TRUE(pipe);
  std::string text;
  for (int c; (c = fgetc(pipe)) != EOF;) text += static_cast<char>(c);
  EXPECT_EQ(pclose(pipe), 0) << text;
  for (const char* name :
       {"opacity", "color", "confidence", "color_cov_diag", "support.1", "roxel:size_in_bricks"})
    EXPECT_THAT(text, HasSubstr(name));
}

TEST_F(VolumeFileTest, RefusesAMissingFileAndAForeignOne) {
  EXPECT_THAT(refusal(path_), testing::AllOf(HasSubstr(path_.string()), HasSubstr("no such file")));
  std::ofstream(path_) << "";
  EXPECT_THAT(refusal(path_), HasSubstr(path_.string()));
  std::ofstream(path_) << std::string(5000, 'x');
  EXPECT_THAT(refusal(path_), testing::AllOf(HasSubstr(path_.string()), HasSubstr("expected a volume")));
}

TEST_F(VolumeFileTest, NamesTheGridsOfAVolumeOfAnotherProgram) {
  const auto density = make_grid<openvdb::FloatGrid>();
  density->setName("density");
  openvdb::io::File(path_.string()).write(openvdb::GridPtrVec{density});
  EXPECT_THAT(refusal(path_), testing::AllOf(HasSubstr(path_.string()), HasSubstr("grids density")));
}

// Reads a volume with one grid replaced or left out.
TEST_F(VolumeFileTest, NamesTheGridThatIsMissingOrDoesNotFit) {
  write_volume(path_, random_volume(), some_info());
  openvdb::io::File file(path_.string());
  file.open(/*delayLoad=*/false);
  const auto grids = file.getGrids();
  const auto meta = file.getMetadata();
  const auto rewritten = [&](auto change) {
    openvdb::GridPtrVec changed;
    for (const auto& grid : *grids)
      if (const auto result = change(grid->deepCopyGrid())) changed.push_back(result);
    const fs::path other = folder_ / "other.vdb";
    openvdb::io::File(other.string()).write(changed, *meta);
    return refusal(other);
  };
  using Ptr = openvdb::GridBase::Ptr;
  EXPECT_EQ(rewritten([](Ptr g) { return g; }), "");
  EXPECT_THAT(rewritten([](Ptr g) { return g->getName() == "support" ? Ptr() : g; }),
              testing::AllOf(HasSubstr("expected a grid \"support\""), HasSubstr("color_mean")));
  EXPECT_THAT(rewritten([](Ptr g) {
                if (g->getName() != "confidence") return g;
                Ptr wrong = make_grid<openvdb::Vec3SGrid>();
                wrong->setName("confidence");
                return wrong;
              }),
              HasSubstr("\"confidence\" of type Tree_vec3s"));
  EXPECT_THAT(rewritten([](Ptr g) {
                if (g->getName() == "confidence") openvdb::gridPtrCast<openvdb::FloatGrid>(g)->clear();
                return g;
              }),
              HasSubstr("other voxels in grid \"confidence\""));
  EXPECT_THAT(rewritten([](Ptr g) {
                if (g->getName() == "opacity")
                  openvdb::gridPtrCast<openvdb::FloatGrid>(g)->tree().setValueOn({-1, 0, 0}, 1);
                return g;
              }),
              HasSubstr("outside the lattice"));
  EXPECT_THAT(rewritten([](Ptr g) {
                if (g->getName() == "optical_depth") {
                  auto tau = openvdb::gridPtrCast<openvdb::FloatGrid>(g);
                  tau->tree().setValueOn(tau->cbeginValueOn().getCoord(), NAN);
                }
                return g;
              }),
              HasSubstr("not finite in grid \"optical_depth\""));
  EXPECT_THAT(rewritten([](Ptr g) {
                if (g->getName() == "opacity") g->removeMeta("roxel:origin");
                return g;
              }),
              HasSubstr("roxel:origin"));
}

TEST_F(VolumeFileTest, RefusesAFileThatEndsEarlyWhereverItEnds) {
  write_volume(path_, random_volume(200), some_info());
  std::ifstream in(path_, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t length = 0; length < whole.size(); length += 1 + length / 16) {
    const fs::path cut = folder_ / "cut.vdb";
    std::ofstream(cut, std::ios::binary).write(whole.data(), length);
    EXPECT_THAT(refusal(cut), HasSubstr("cut.vdb")) << length << " of " << whole.size() << " bytes";
  }
  std::ofstream(folder_ / "cut.vdb", std::ios::binary).write(whole.data(), whole.size() - 1);
  EXPECT_THAT(refusal(folder_ / "cut.vdb"), HasSubstr("cut.vdb"));
}

TEST_F(VolumeFileTest, LeavesNoFileWhereItCannotWrite) {
  std::ofstream(folder_ / "file") << "in the way";
  EXPECT_THROW(write_volume(folder_ / "file" / "volume.vdb", random_volume(10), some_info()), IoError);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

}  // namespace
}  // namespace roxel
