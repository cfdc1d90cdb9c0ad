#include "roxel/io/kept_images.h"

#include <array>
#include <cstdint>
#include <fstream>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"

namespace roxel {

namespace {

constexpr std::uint32_t kMark = 0x696b7872;  // "rxki"
constexpr std::int32_t kMostNumbers = 1 << 30;

using Size = std::array<std::int32_t, 3>;  ///< width, height, channels

template <class T>
void put(std::ofstream& file, const T* from, std::size_t count) {
  file.write(reinterpret_cast<const char*>(from), static_cast<std::streamsize>(count * sizeof(T)));
}

template <class T>
bool get(std::ifstream& file, T* to, std::size_t count) {
  return static_cast<bool>(
      file.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count * sizeof(T))));
}

}  // namespace

void write_kept_images(const std::filesystem::path& path, const std::vector<const Image*>& images) {
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    const std::uint32_t head[2] = {kMark, static_cast<std::uint32_t>(images.size())};
    put(file, head, 2);
    for (const Image* image : images) {
      const Size size{image->width(), image->height(), image->channels()};
      put(file, size.data(), size.size());
      put(file, image->data().data(), image->data().size());
    }
    file.close();
    if (!file) throw IoError(path.string() + ": writing failed (disc full, or no permission?)");
  });
}

std::vector<Image> read_kept_images(const std::filesystem::path& path) {
  const auto refuse = [&] {
    throw IoError(path.string() + ": missing or cut off: what this run had put aside there");
  };
  std::ifstream file(path, std::ios::binary);
  std::uint32_t head[2] = {0, 0};
  if (!get(file, head, 2) || head[0] != kMark) refuse();
  std::vector<Image> images;
  for (std::uint32_t i = 0; i < head[1]; ++i) {
    Size size;
    if (!get(file, size.data(), size.size())) refuse();
    const double pixels = 1.0 * size[0] * size[1] * size[2];
    if (size[0] < 0 || size[1] < 0 || size[2] < 0 || pixels > kMostNumbers) refuse();
    Image image = pixels > 0 ? Image(size[0], size[1], size[2]) : Image();
    if (!get(file, image.data().data(), image.data().size())) refuse();
    images.push_back(std::move(image));
  }
  return images;
}

}  // namespace roxel
