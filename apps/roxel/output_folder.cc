#include "output_folder.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "roxel/base/error.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

/// Folders below an output that commands write into.
constexpr const char* kResultFolders[] = {"depth",  "render", "error",  "light", "opacity",
                                          "images", "masks",  "sparse", "sky"};

/// Absolute, without links. Twice, for "missing/../link": links after a part that does not exist stay.
fs::path resolved(const fs::path& path) {
  return fs::weakly_canonical(fs::weakly_canonical(fs::absolute(path)));
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

/// Whether the file, or the link that leads to it, is somewhere below `folder`.
bool holds(const fs::path& folder, const fs::path& file) {
  return lies_in(resolved(file.parent_path()), folder) || lies_in(resolved(file), folder);
}

[[noreturn]] void refuse(const fs::path& output, const std::string& found) {
  throw_invalid("-o " + output.string(), found, "another folder, where no source is overwritten");
}

fs::path dataset_folder(const Dataset& dataset) {
  const fs::path path = resolved(dataset.path);
  return fs::is_directory(path) ? path : path.parent_path();
}

void protect_images(const fs::path& output, const fs::path& folder, const Dataset& dataset) {
  for (const View& view : dataset.views)
    for (const std::string& file : {view.image_path, view.mask_path})
      if (!file.empty() && holds(folder, file)) refuse(output, "a folder with " + file + " in it");
}

/// Results that would go through a link to somewhere in the sources.
void protect_linked(const fs::path& output, const Sources& sources) {
  for (const char* name : kResultFolders) {
    if (!fs::is_symlink(output / name)) continue;
    const fs::path target = resolved(output / name);
    const std::string found = std::string("a link ") + name + " into what is read";
    for (const fs::path& folder : sources.folders)
      if (lies_in(target, resolved(folder))) refuse(output, found);
    if (!sources.dataset) continue;
    if (lies_in(target, dataset_folder(*sources.dataset))) refuse(output, found);
    protect_images(output, target, *sources.dataset);
  }
}

/// The first of the folder and those above it that exists.
fs::path nearest_existing(fs::path folder) {
  std::error_code error;
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  return folder;
}

void move_file(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) throw IoError(to.string() + ": cannot be written (" + error.message() + ")");
}

}  // namespace

void protect_sources(const fs::path& output, const Sources& sources) {
  const fs::path folder = resolved(output);
  for (const fs::path& source : sources.folders)
    if (folder == resolved(source)) refuse(output, "a folder that is read");
  if (sources.dataset) {
    if (folder == dataset_folder(*sources.dataset)) refuse(output, "the data set itself");
    protect_images(output, folder, *sources.dataset);
  }
  protect_linked(output, sources);
}

OutputFolder::OutputFolder(fs::path path) : path_(std::move(path)) {
  const fs::path absolute = fs::absolute(path_).lexically_normal();
  const fs::path existing = nearest_existing(absolute);
  std::error_code error;
  if (!fs::is_directory(existing, error) && !error)
    throw_invalid("-o " + path_.string(), "a file, " + existing.string(), "a folder, or a name that is free");
  std::vector<fs::path> missing;
  for (fs::path folder = absolute; folder != existing; folder = folder.parent_path())
    if (folder.has_filename()) missing.push_back(folder);
  fs::create_directories(path_, error);
  if (error || !fs::is_directory(path_)) {
    const std::string why = error ? error.message() : "it is not a folder";
    throw IoError(path_.string() + ": cannot be made: " + why);
  }
  made_.assign(missing.rbegin(), missing.rend());
  const fs::path probe = path_ / (".roxel-probe-" + std::to_string(getpid()));
  const bool written = static_cast<bool>(std::ofstream(probe) << "x" << std::flush);
  fs::remove(probe, error);
  if (!written) throw IoError(path_.string() + ": cannot be written to");
}

OutputFolder::~OutputFolder() {
  std::error_code error;
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder)
    if (!fs::is_empty(*folder, error) || error || !fs::remove(*folder, error)) return;
}

PartialResults::PartialResults(const fs::path& target) : target_(target), path_(target / ".partial") {
  std::error_code error;
  fs::remove_all(path_, error);  // of a program that was killed
  fs::create_directories(path_, error);
  if (error) throw IoError(path_.string() + ": cannot be made: " + error.message());
}

PartialResults::~PartialResults() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::vector<fs::path> PartialResults::files() const {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(path_))
    if (!entry.is_directory()) found.push_back(entry.path().lexically_relative(path_));
  // Last come the files by which a folder is known, so that one which has them is complete.
  std::stable_partition(found.begin(), found.end(), [](const fs::path& file) {
    return file != "summary.json" && file != "transforms.json" && file != "metrics.json";
  });
  return found;
}

void PartialResults::make_way(const std::vector<fs::path>& names) const {
  for (const fs::path& name : names) {
    const fs::path to = target_ / name;
    std::error_code error;
    fs::create_directories(to.parent_path(), error);
    if (error) throw IoError(to.parent_path().string() + ": cannot be made: " + error.message());
    if (fs::is_directory(to)) throw IoError(to.string() + ": cannot be written (it is a folder)");
  }
}

void PartialResults::move_all(const std::vector<fs::path>& names) const {
  for (const fs::path& name : names) {
    fs::create_directories((target_ / name).parent_path());  // where it went with older files
    move_file(path_ / name, target_ / name);
  }
}

void PartialResults::publish(const std::function<void()>& remove_older) {
  const std::vector<fs::path> names = files();
  make_way(names);
  remove_older();
  move_all(names);
}

void PartialResults::publish_over(const std::vector<std::string>& older) {
  const std::vector<fs::path> names = files();
  make_way(names);
  move_all(names);
  std::error_code ignored;
  for (const std::string& name : older)
    if (std::find(names.begin(), names.end(), name) == names.end()) fs::remove(target_ / name, ignored);
}

}  // namespace roxel::cli
