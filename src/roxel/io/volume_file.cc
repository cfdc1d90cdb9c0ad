// A grid a channel, a leaf a brick. roxel's lattice starts at voxel (0, 0, 0) of OpenVDB's index space, so
// leaves and bricks coincide; OpenVDB's transform maps an index to the voxel's centre, ours to its corner.
// Numbers that must survive exactly (frames) are metadata, since a transform is a product of matrices.
#include "roxel/io/volume_file.h"

#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>

#include <cmath>
#include <fstream>
#include <map>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/volume/shown_color.h"
#include "roxel/volume/vdb_grids.inl"

namespace roxel {
namespace {

using openvdb::FloatGrid;
using openvdb::GridBase;
using openvdb::Vec3f;
using openvdb::Vec3SGrid;

constexpr int kVolumeFormat = 1;
constexpr const char* kExpected = "a volume written by roxel (docs/format.md)";
constexpr const char* kCreator = "roxel " ROXEL_VERSION;

// Name of a channel's grid: plain in the box, with the lattice's number in surround.
std::string grid_name(const std::string& channel, int lattice) {
  return lattice == 0 ? channel : channel + "." + std::to_string(lattice);
}

openvdb::Coord first_voxel(const Brick& brick) {
  const Eigen::Vector3i at = kBrickSide * brick.coord;
  return {at.x(), at.y(), at.z()};
}

// roxel numbers the voxels of a brick x fastest, OpenVDB z fastest; the map is its own inverse.
openvdb::Index swap_order(int n) { return (n >> 6) | (n & 0x38) | ((n & 7) << 6); }

template <class Visit>
void for_each_voxel(const Brick& brick, Visit visit) {
  brick.for_each_voxel([&](int v, std::uint32_t slot) { visit(swap_order(v), slot); });
}

// ---------------------------------------------------------------------------------------------- writing

template <class GridType, class Get>
GridBase::Ptr grid_of(const BrickIndex& index, Get get) {
  using Leaf = typename GridType::TreeType::LeafNodeType;
  const auto grid = make_grid<GridType>(openvdb::zeroVal<typename GridType::ValueType>());
  for (const Brick& brick : index.bricks()) {
    auto leaf = std::make_unique<Leaf>(first_voxel(brick), grid->background());
    for_each_voxel(brick, [&](openvdb::Index at, std::uint32_t slot) { leaf->setValueOn(at, get(slot)); });
    grid->tree().addLeaf(leaf.release());
  }
  return grid;
}

// The channels of one lattice as grids, in the order of docs/format.md.
std::vector<std::pair<std::string, GridBase::Ptr>> channel_grids(const Volume& v, const VolumeInfo& info,
                                                                 int lattice) {
  const BrickIndex& index = v.index(lattice);
  const auto scalar = [&](auto get) { return grid_of<FloatGrid>(index, get); };
  const auto vector = [&](auto get) { return grid_of<Vec3SGrid>(index, get); };
  return {
      {"opacity", scalar([&](auto s) { return alpha_from_tau(v.tau[s]); })},
      {"color", vector([&](auto s) { return Vec3f(shown_color(v, info.colors, s).data()); })},
      {"confidence", scalar([&](auto s) { return v.confidence[s]; })},
      {"optical_depth", scalar([&](auto s) { return v.tau[s]; })},
      {"color_mean", vector([&](auto s) { return Vec3f(v.color_mean[s].data()); })},
      {"color_cov_diag", vector([&](auto s) { return Vec3f(v.color_cov[s].unpacked().data()); })},
      {"color_cov_off", vector([&](auto s) { return Vec3f(v.color_cov[s].unpacked().data() + 3); })},
      {"support", vector([&](auto s) { return Vec3f(v.color_weight[s], v.support[s][0], v.support[s][1]); })},
  };
}

void describe(GridBase& grid, const std::string& channel, int lattice, const LatticeFrame& frame) {
  const Eigen::Vector3d centre = frame.voxel_centre({0, 0, 0});
  const auto transform = openvdb::math::Transform::createLinearTransform(frame.voxel_size);
  transform->postTranslate({centre.x(), centre.y(), centre.z()});
  grid.setTransform(transform);
  grid.setName(grid_name(channel, lattice));
  grid.setCreator(kCreator);
  if (channel == "opacity") grid.setGridClass(openvdb::GRID_FOG_VOLUME);
  const Eigen::Vector3d& o = frame.origin;
  const Eigen::Vector3i& n = frame.size_in_bricks;
  grid.insertMeta("roxel:origin", openvdb::Vec3DMetadata({o.x(), o.y(), o.z()}));
  grid.insertMeta("roxel:voxel_size", openvdb::DoubleMetadata(frame.voxel_size));
  grid.insertMeta("roxel:size_in_bricks", openvdb::Vec3IMetadata({n.x(), n.y(), n.z()}));
}

openvdb::MetaMap file_metadata(const VolumeInfo& info, bool fitted, int lattice_count) {
  openvdb::MetaMap meta;
  const WhitePoint& white = info.colors.white();
  meta.insertMeta("roxel:version", openvdb::StringMetadata(ROXEL_VERSION));
  meta.insertMeta("roxel:format", openvdb::Int32Metadata(kVolumeFormat));
  meta.insertMeta("roxel:lattices", openvdb::Int32Metadata(lattice_count));
  meta.insertMeta("roxel:color_space", openvdb::StringMetadata(to_string(info.colors.space())));
  meta.insertMeta("roxel:white_point", openvdb::Vec2DMetadata({white.x, white.y}));
  meta.insertMeta("roxel:exposure", openvdb::DoubleMetadata(info.exposure));
  meta.insertMeta("roxel:color_fitted", openvdb::BoolMetadata(fitted));
  meta.insertMeta("roxel:dataset", openvdb::StringMetadata(info.dataset));
  return meta;
}

// ---------------------------------------------------------------------------------------------- reading

// Grids and metadata of one file by name, and errors that name it.
class Archive {
 public:
  explicit Archive(const std::filesystem::path& path) : path_(path) {
    if (!std::filesystem::is_regular_file(path)) refuse("no such file");
    // With exceptions on, reading stops where the file does, whatever OpenVDB itself checks.
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse("a file that cannot be opened");
    try {
      file.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
      openvdb::io::Stream stream(file, /*delayLoad=*/false);
      meta_ = stream.getMetadata();
      for (const GridBase::Ptr& grid : *stream.getGrids()) grids_[grid->getName()] = grid;
    } catch (const std::ios::failure&) {
      refuse("a file that ends early or is no OpenVDB file");
    } catch (const std::exception& e) {
      refuse(std::string("unreadable content (") + e.what() + ")");
    }
  }

  [[noreturn]] void refuse(const std::string& found, const std::string& expected = kExpected) const {
    throw_invalid(path_.string(), found, expected);
  }

  template <class GridType>
  std::shared_ptr<GridType> grid(const std::string& name) const {
    const auto it = grids_.find(name);
    if (it == grids_.end()) refuse(names(), "a grid \"" + name + "\"");
    auto typed = openvdb::gridPtrCast<GridType>(it->second);
    if (!typed) refuse("grid \"" + name + "\" of type " + it->second->type(), "type " + GridType::gridType());
    return typed;
  }

  // The value of a metadata entry of the file, or of a grid where one is given.
  template <class T>
  T value(const std::string& key, const GridBase* of = nullptr) const {
    const auto entry = (of ? static_cast<const openvdb::MetaMap&>(*of) : *meta_)
                           .template getMetadata<openvdb::TypedMetadata<T>>(key);
    if (!entry) refuse(names() + " without metadata \"" + key + "\"");
    return entry->value();
  }
  /// Of an entry that older files do not have: false.
  bool is_set(const std::string& key) const {
    const auto entry = meta_->getMetadata<openvdb::BoolMetadata>(key);
    return entry && entry->value();
  }

 private:
  std::string names() const {
    std::string list = grids_.empty() ? "no grids" : "grids";
    for (const auto& [name, grid] : grids_) list += (list == "grids" ? " " : ", ") + name;
    return list;
  }

  std::filesystem::path path_;
  openvdb::MetaMap::Ptr meta_;
  std::map<std::string, GridBase::Ptr> grids_;
};

VolumeInfo info_from(const Archive& archive) {
  if (const int format = archive.value<std::int32_t>("roxel:format"); format != kVolumeFormat)
    archive.refuse("format " + std::to_string(format), "format " + std::to_string(kVolumeFormat));
  const openvdb::Vec2d white = archive.value<openvdb::Vec2d>("roxel:white_point");
  if (!(white.x() > 0 && white.y() > 0 && white.x() + white.y() < 1))
    archive.refuse("an impossible white point");
  VolumeInfo info;
  const ColorSpace space = parse_color_space(archive.value<std::string>("roxel:color_space"));
  info.colors = ColorTransform(space, {white.x(), white.y()});
  info.exposure = archive.value<double>("roxel:exposure");
  info.dataset = archive.value<std::string>("roxel:dataset");
  if (!(std::isfinite(info.exposure) && info.exposure > 0))
    archive.refuse("exposure " + std::to_string(info.exposure), "a positive number");
  return info;
}

LatticeFrame frame_from(const Archive& archive, const GridBase& grid) {
  const auto origin = archive.value<openvdb::Vec3d>("roxel:origin", &grid);
  const auto size = archive.value<openvdb::Vec3i>("roxel:size_in_bricks", &grid);
  LatticeFrame frame{{origin.x(), origin.y(), origin.z()},
                     archive.value<double>("roxel:voxel_size", &grid),
                     {size.x(), size.y(), size.z()}};
  const bool sane = frame.origin.allFinite() && std::isfinite(frame.voxel_size) && frame.voxel_size > 0 &&
                    (frame.size_in_bricks.array() > 0).all() &&
                    frame.size_in_bricks.cast<double>().prod() <= 1 << 28;
  if (!sane) archive.refuse("an impossible lattice in grid \"" + grid.getName() + "\"");
  return frame;
}

Topology topology_from(const Archive& archive, int lattice) {
  const auto grid = archive.grid<FloatGrid>(grid_name("opacity", lattice));
  const LatticeFrame frame = frame_from(archive, *grid);
  const Eigen::Vector3i n = frame.size_in_voxels();
  const openvdb::CoordBBox box({0, 0, 0}, {n.x() - 1, n.y() - 1, n.z() - 1});
  const openvdb::CoordBBox active = grid->evalActiveVoxelBoundingBox();
  if (!active.empty() && !box.isInside(active)) archive.refuse("voxels outside the lattice's box");
  grid->tree().voxelizeActiveTiles();  // other programs may have pruned uniform regions
  Topology topology(frame);
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord at = leaf->origin();
    BrickMask mask;
    for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) mask.set(swap_order(voxel.pos()));
    topology.insert_brick({at.x() / kBrickSide, at.y() / kBrickSide, at.z() / kBrickSide}, mask);
  }
  return topology;
}

bool is_finite(float x) { return std::isfinite(x); }
bool is_finite(const Vec3f& x) { return std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]); }

// Calls put(slot, value) for every voxel of a lattice with the value that the channel's grid holds there.
template <class GridType, class Put>
void fill(const Archive& archive, const BrickIndex& index, const std::string& name, Put put) {
  const auto grid = archive.grid<GridType>(name);
  grid->tree().voxelizeActiveTiles();
  for (const Brick& brick : index.bricks()) {
    const auto* leaf = grid->tree().probeConstLeaf(first_voxel(brick));
    for_each_voxel(brick, [&](openvdb::Index at, std::uint32_t slot) {
      if (!leaf || !leaf->isValueOn(at))
        archive.refuse("other voxels in grid \"" + name + "\" than in opacity");
      if (!is_finite(leaf->getValue(at)))
        archive.refuse("a value that is not finite in grid \"" + name + "\"");
      put(slot, leaf->getValue(at));
    });
  }
}

void fill_lattice(const Archive& archive, int lattice, Volume& v) {
  const BrickIndex& index = v.index(lattice);
  const auto scalar = [&](const char* channel, auto put) {
    fill<FloatGrid>(archive, index, grid_name(channel, lattice), put);
  };
  const auto vector = [&](const char* channel, auto put) {
    fill<Vec3SGrid>(archive, index, grid_name(channel, lattice), put);
  };
  scalar("optical_depth", [&](auto s, float x) { v.tau[s] = x; });
  scalar("confidence", [&](auto s, float x) { v.confidence[s] = x; });
  vector("color_mean", [&](auto s, const Vec3f& x) { v.color_mean[s] = {x[0], x[1], x[2]}; });
  if (!v.fitted_color.empty())
    vector("color", [&](auto s, const Vec3f& x) { v.fitted_color[s] = {x[0], x[1], x[2]}; });
  vector("color_cov_diag", [&](auto s, const Vec3f& x) {
    v.color_cov[s] = PackedCovariance({x[0], x[1], x[2], 0, 0, 0});
  });
  vector("color_cov_off", [&](auto s, const Vec3f& x) {
    const std::array<float, 6> cov = v.color_cov[s].unpacked();
    v.color_cov[s] = PackedCovariance({cov[0], cov[1], cov[2], x[0], x[1], x[2]});
  });
  vector("support", [&](auto s, const Vec3f& x) {
    v.color_weight[s] = x[0];
    v.support[s] = {x[1], x[2]};
  });
}

}  // namespace

void write_volume(const std::filesystem::path& path, const Volume& volume, const VolumeInfo& info,
                  SavedLattices lattices) {
  openvdb::initialize();
  const int count =
      lattices == SavedLattices::kAll ? volume.lattice_count() : std::min(1, volume.lattice_count());
  openvdb::GridCPtrVec grids;
  for (int k = 0; k < count; ++k)
    for (auto& [channel, grid] : channel_grids(volume, info, k)) {
      describe(*grid, channel, k, volume.index(k).frame());
      grids.push_back(grid);
    }
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    try {
      // OpenVDB's own files do not say when the disc is full; a stream with exceptions on does.
      std::ofstream file;
      file.exceptions(std::ios::failbit | std::ios::badbit);
      file.open(temporary, std::ios::binary);
      openvdb::io::Stream(file).write(grids, file_metadata(info, !volume.fitted_color.empty(), count));
      file.close();
    } catch (const std::ios_base::failure&) {
      throw IoError(path.string() + ": writing failed (disc full, or no permission?)");
    } catch (const std::exception& e) {
      throw IoError(path.string() + ": cannot write the volume: " + e.what());
    }
  });
}

VolumeFile read_volume(const std::filesystem::path& path) {
  openvdb::initialize();
  const Archive archive(path);
  VolumeFile file;
  file.info = info_from(archive);
  std::vector<Topology> lattices;
  for (int k = 0; k < archive.value<std::int32_t>("roxel:lattices"); ++k)
    lattices.push_back(topology_from(archive, k));
  file.volume = Volume(std::move(lattices));
  if (archive.is_set("roxel:color_fitted")) file.volume.fitted_color.resize(file.volume.slot_count());
  for (int k = 0; k < file.volume.lattice_count(); ++k) fill_lattice(archive, k, file.volume);
  return file;
}

}  // namespace roxel
