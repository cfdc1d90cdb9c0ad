#include "roxel/io/dataset_files.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 14> kImageSuffixes = {".png",  ".jpg", ".jpeg", ".tif", ".tiff",
                                                        ".exr",  ".hdr", ".bmp",  ".ppm", ".pgm",
                                                        ".webp", ".jp2", ".tga",  ".pic"};

template <class Choose>
std::vector<fs::path> files_where(const fs::path& folder, const Choose& choose) {
  std::vector<fs::path> found;
  if (!fs::is_directory(folder)) return found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file() || !choose(entry.path().filename().string())) continue;
    check_name(entry.path().filename().string(), escaped(folder.string(), 4000));
    found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::vector<fs::path> files_ending_in(const fs::path& folder, std::initializer_list<const char*> endings) {
  return files_where(folder, [&](const std::string& name) {
    return std::any_of(endings.begin(), endings.end(),
                       [&](const char* ending) { return name.ends_with(ending); });
  });
}

bool has_image_suffix(const std::string& name) {
  std::string suffix = fs::path(name).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return std::find(kImageSuffixes.begin(), kImageSuffixes.end(), suffix) != kImageSuffixes.end();
}

std::vector<fs::path> image_files(const fs::path& folder) { return files_where(folder, has_image_suffix); }

fs::path image_beside(const fs::path& folder, const std::string& name) {
  fs::path image = folder / name;
  if (!fs::exists(image) && fs::is_directory(folder / "images")) image = folder / "images" / name;
  return fs::absolute(image).lexically_normal();
}

std::string describe_folder(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    names.push_back(escaped(entry.path().filename().string()) + (entry.is_directory() ? "/" : ""));
  }
  if (names.empty()) return "an empty folder";
  std::sort(names.begin(), names.end());
  std::string list;
  constexpr std::size_t kShown = 8;
  for (std::size_t i = 0; i < std::min(kShown, names.size()); ++i) list += (i ? ", " : "") + names[i];
  if (names.size() > kShown) list += ", ...";
  return std::to_string(names.size()) + (names.size() == 1 ? " entry (" : " entries (") + list + ")";
}

fs::path mask_in_folder(const fs::path& folder, const std::string& relative_image) {
  for (const std::string& stem : {without_suffix(relative_image), relative_image}) {
    for (const char* suffix : {".png", ".PNG", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".bmp"}) {
      const fs::path mask = folder / (stem + suffix);
      if (fs::is_regular_file(mask)) return mask;
    }
  }
  return {};
}

}  // namespace roxel
