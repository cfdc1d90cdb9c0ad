#include "roxel/io/checkpoint_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "roxel/base/atomic_file.h"
#include "roxel/base/content_hash.h"
#include "roxel/base/error.h"

namespace roxel {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PassRecord, level, pass, draft, active_voxels, rays, steps, color_steps,
                                   mean_log_likelihood, mean_opacity_change, mean_opacity, seconds,
                                   color_seconds, opacity_seconds, ns_per_step)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LightRecord, level, pass, fitted_views, largest_change, spread)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LevelRecord, voxel_size, voxels_in_box, voxels_around, converged, seconds,
                                   peak_memory_bytes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StageRecord, name, seconds, peak_memory_bytes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Summary, termination, levels, passes, light, stages, notes, seconds,
                                   peak_memory_bytes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PassState, level, passes, draft_passes, resting, light_rests, level_done,
                                   light_from, level_seconds, level_peak_bytes)

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::string_view kMagic = "roxel checkpoint\n";
constexpr std::uint32_t kCheckpointFormat = 3;

/// What is wrong with a file: the reader goes on to the one before.
struct Damaged {
  std::string found;
};

fs::path folder_of(const fs::path& run) { return run / "checkpoint"; }
fs::path latest_of(const fs::path& run) { return folder_of(run) / "latest.roxel"; }
fs::path previous_of(const fs::path& run) { return folder_of(run) / "previous.roxel"; }

/// Bytes to a file, and their hash at its end.
class HashingWriter {
 public:
  explicit HashingWriter(const fs::path& file) : out_(file, std::ios::binary) {}

  void bytes(std::string_view data) {
    hash_.update(data);
    out_.write(data.data(), static_cast<std::streamsize>(data.size()));
  }
  template <class T>
  void value(const T& item) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes({reinterpret_cast<const char*>(&item), sizeof item});
  }
  template <class T>
  void array(const std::vector<T>& items) {
    static_assert(std::is_trivially_copyable_v<T>);
    value(static_cast<std::uint64_t>(items.size()));
    bytes({reinterpret_cast<const char*>(items.data()), items.size() * sizeof(T)});
  }
  /// Returns whether all of it was taken.
  bool finish() {
    value(std::uint64_t{hash_.value()});
    out_.close();
    return static_cast<bool>(out_);
  }

 private:
  std::ofstream out_;
  ContentHash hash_;
};

/// The same way back. Throws Damaged.
class HashingReader {
 public:
  explicit HashingReader(const fs::path& file) : in_(file, std::ios::binary) {
    std::error_code error;
    left_ = fs::file_size(file, error);
    if (error || !in_) throw Damaged{"a file that cannot be read"};
  }

  void bytes(char* data, std::uint64_t size) {
    if (size > left_) throw Damaged{"a file that is cut off"};
    in_.read(data, static_cast<std::streamsize>(size));
    if (!in_) throw Damaged{"a file that cannot be read to its end"};
    left_ -= size;
    hash_.update({data, size});
  }
  template <class T>
  T value() {
    T item;
    bytes(reinterpret_cast<char*>(&item), sizeof item);
    return item;
  }
  template <class T>
  std::vector<T> array() {
    const auto count = value<std::uint64_t>();
    if (count > left_ / sizeof(T)) throw Damaged{"a file that is cut off, or a length that is not one"};
    std::vector<T> items(count);
    bytes(reinterpret_cast<char*>(items.data()), count * sizeof(T));
    return items;
  }
  /// Reads on to the checksum at the end, and compares.
  void check_rest() {
    std::vector<char> block(1 << 20);
    if (left_ < sizeof(std::uint64_t)) throw Damaged{"a file that is cut off"};
    while (left_ > sizeof(std::uint64_t))
      bytes(block.data(), std::min<std::uint64_t>(block.size(), left_ - sizeof(std::uint64_t)));
    const std::uint64_t expected = hash_.value();
    if (value<std::uint64_t>() != expected) throw Damaged{"content that does not fit its checksum"};
  }

 private:
  std::ifstream in_;
  std::uint64_t left_ = 0;
  ContentHash hash_;
};

/// Nothing is made of a file before all of it is known to be as it was written.
void check_whole(const fs::path& file) { HashingReader(file).check_rest(); }

/// A brick of a topology: where, and which of its voxels are there.
struct BrickRecord {
  std::array<std::int32_t, 3> coord;
  std::array<std::uint8_t, kBrickVoxels / 8> voxels;
};

void write_topology(const Topology& topology, HashingWriter& out) {
  const LatticeFrame& frame = topology.frame();
  for (int axis = 0; axis < 3; ++axis) out.value(frame.origin[axis]);
  out.value(frame.voxel_size);
  for (int axis = 0; axis < 3; ++axis) out.value(std::int32_t{frame.size_in_bricks[axis]});
  std::vector<BrickRecord> bricks;
  topology.for_each_brick([&](const Eigen::Vector3i& coord, const BrickMask& mask) {
    BrickRecord record{{coord.x(), coord.y(), coord.z()}, {}};
    for (auto v = mask._Find_first(); v < mask.size(); v = mask._Find_next(v))
      record.voxels[v / 8] |= static_cast<std::uint8_t>(1u << (v % 8));
    bricks.push_back(record);
  });
  out.array(bricks);
}

Topology read_topology(HashingReader& in) {
  LatticeFrame frame;
  for (int axis = 0; axis < 3; ++axis) frame.origin[axis] = in.value<double>();
  frame.voxel_size = in.value<double>();
  for (int axis = 0; axis < 3; ++axis) frame.size_in_bricks[axis] = in.value<std::int32_t>();
  if ((frame.size_in_bricks.array() < 1).any() || frame.size_in_bricks.cast<double>().prod() > kMaxBricks)
    throw Damaged{"a lattice without a size"};
  Topology topology(frame);
  for (const BrickRecord& record : in.array<BrickRecord>()) {
    BrickMask mask;
    for (int v = 0; v < kBrickVoxels; ++v) mask[v] = record.voxels[v / 8] >> (v % 8) & 1;
    topology.insert_brick({record.coord[0], record.coord[1], record.coord[2]}, mask);
  }
  return topology;
}

void write_volume_part(const Volume& volume, HashingWriter& out) {
  out.value(std::int32_t{volume.lattice_count()});
  for (int k = 0; k < volume.lattice_count(); ++k) write_topology(volume.topology(k), out);
  out.array(volume.tau);
  out.array(volume.confidence);
  out.array(volume.color_weight);
  out.array(volume.color_mean);
  out.array(volume.color_cov);
  out.array(volume.support);
}

template <class T>
void read_channel(HashingReader& in, std::vector<T>& channel) {
  const std::size_t slots = channel.size();
  channel = in.array<T>();
  if (channel.size() != slots) throw Damaged{"a channel of another length than its voxels"};
}

Volume read_volume_part(HashingReader& in) {
  const auto lattices = in.value<std::int32_t>();
  if (lattices < 1 || lattices > 64) throw Damaged{"no lattices"};
  std::vector<Topology> topologies;
  for (int k = 0; k < lattices; ++k) topologies.push_back(read_topology(in));
  Volume volume(std::move(topologies));
  read_channel(in, volume.tau);
  read_channel(in, volume.confidence);
  read_channel(in, volume.color_weight);
  read_channel(in, volume.color_mean);
  read_channel(in, volume.color_cov);
  read_channel(in, volume.support);
  return volume;
}

/// The first path at which two JSON values differ, with both values; empty where they are the same.
std::string first_difference(const json& found, const json& expected, const std::string& path) {
  if (found == expected) return "";
  if (found.is_object() && expected.is_object()) {
    json keys = found;
    keys.update(expected);
    for (const auto& [key, unused] : keys.items()) {
      const json none;
      const std::string difference = first_difference(found.value(key, none), expected.value(key, none),
                                                      path.empty() ? key : path + "." + key);
      if (!difference.empty()) return difference;
    }
  }
  return path + " " + found.dump() + " (now " + expected.dump() + ")";
}

/// Its made_from and all the rest. Throws Damaged.
std::pair<json, Checkpoint> read_file(const fs::path& file) {
  try {
    check_whole(file);
    HashingReader in(file);
    std::string magic(kMagic.size(), ' ');
    in.bytes(magic.data(), magic.size());
    if (magic != kMagic) throw Damaged{"another kind of file"};
    if (const auto format = in.value<std::uint32_t>(); format != kCheckpointFormat)
      throw Damaged{"a checkpoint of format " + std::to_string(format)};
    const std::vector<char> text = in.array<char>();
    const json header = json::parse(text.begin(), text.end());
    Checkpoint checkpoint;
    checkpoint.state = header.at("state").get<PassState>();
    checkpoint.summary = header.at("summary").get<Summary>();
    checkpoint.light = in.array<std::array<float, 3>>();
    checkpoint.accelerated = in.array<Acceleration::Step>();
    checkpoint.volume = read_volume_part(in);
    return {header.at("made_from"), std::move(checkpoint)};
  } catch (const json::exception&) {
    throw Damaged{"a header that cannot be read"};
  }
}

/// Waits until a file, or the names in a folder, are on the disc. Returns whether they are.
bool sync(const fs::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool done = fsync(file) == 0;
  close(file);
  return done;
}

}  // namespace

void write_checkpoint(const fs::path& run, const ordered_json& made_from, const CheckpointView& checkpoint,
                      EarlierCheckpoints earlier) {
  const fs::path latest = latest_of(run);
  const fs::path fresh = folder_of(run) / "new.roxel";
  write_file_atomically(fresh, [&](const fs::path& temporary) {
    const json header{{"made_from", made_from}, {"state", checkpoint.state}, {"summary", checkpoint.summary}};
    const std::string text = header.dump(-1, ' ', false, json::error_handler_t::replace);
    HashingWriter out(temporary);
    out.bytes(kMagic);
    out.value(kCheckpointFormat);
    out.array(std::vector<char>(text.begin(), text.end()));
    out.array(checkpoint.light);
    out.array(checkpoint.accelerated);
    write_volume_part(checkpoint.volume, out);
    if (!out.finish() || !sync(temporary))
      throw IoError(latest.string() + ": writing failed (disc full, or no permission?)");
  });
  std::error_code error;
  if (earlier == EarlierCheckpoints::kRotate && fs::exists(latest))
    fs::rename(latest, previous_of(run), error);
  if (!error) fs::rename(fresh, latest, error);
  if (!error && earlier == EarlierCheckpoints::kReplace) fs::remove(previous_of(run), error);
  if (error) throw IoError(latest.string() + ": cannot be written (" + error.message() + ")");
  sync(folder_of(run));
}

std::optional<FoundCheckpoint> read_checkpoint(const fs::path& run, const ordered_json& made_from) {
  // What is read back has gone through text, so what it is compared with does, too.
  const json wanted = json::parse(made_from.dump(-1, ' ', false, json::error_handler_t::replace));
  std::string damage;
  for (const fs::path& file : {latest_of(run), folder_of(run) / "new.roxel", previous_of(run)}) {
    if (!fs::exists(file)) continue;
    try {
      auto [found, checkpoint] = read_file(file);
      const std::string difference = first_difference(found, wanted, "");
      if (!difference.empty())
        throw_invalid((damage.empty() ? "" : damage + "; ") + file.string(), "a checkpoint of " + difference,
                      "the data set and options that it was made with");
      return FoundCheckpoint{std::move(checkpoint), damage};
    } catch (const Damaged& error) {
      if (!damage.empty()) damage += "; ";
      damage += file.string() + ": found " + error.found + ", expected a checkpoint";
    }
  }
  if (!damage.empty()) throw InvalidInput(damage);
  return std::nullopt;
}

bool has_checkpoint(const fs::path& run) {
  return fs::exists(latest_of(run)) || fs::exists(previous_of(run));
}

void remove_checkpoints(const fs::path& run) {
  std::error_code ignored;
  if (!fs::is_symlink(folder_of(run))) fs::remove_all(folder_of(run), ignored);
}

}  // namespace roxel
