/// Pictures side by side as one JPEG:
///
///     contact_sheet OUT.jpg COLUMNS WIDTH FILE...
///
/// Row by row, each picture at most WIDTH pixels wide; "-" leaves a place empty. EXR is radiance, 1 = white.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "roxel/base/atomic_file.h"
#include "roxel/io/image_bytes.h"
#include "roxel/io/image_file.h"
#include "roxel/report/pictures.h"

namespace {

using namespace roxel;

/// Display values are kept as they stand.
constexpr Response kAsItIs{ResponseCurve::kLinear};
constexpr float kEmpty = 0.13f;

Image picture_of(const std::string& path, int width) {
  if (path == "-") return Image(8, 8, 3, kEmpty);
  const Image picture = read_image(path, kAsItIs).rgb;
  return thumbnail(path.ends_with(".exr") ? encoded_picture(picture, 1, {}) : picture, width);
}

std::vector<std::vector<Image>> rows_of(int argc, char** argv, int columns, int width) {
  std::vector<std::vector<Image>> rows;
  for (int i = 4; i < argc; ++i) {
    if ((i - 4) % columns == 0) rows.emplace_back();
    rows.back().push_back(picture_of(argv[i], width));
  }
  return rows;
}

}  // namespace

int main(int argc, char** argv) {
  const int columns = argc > 2 ? std::atoi(argv[2]) : 0, width = argc > 3 ? std::atoi(argv[3]) : 0;
  if (argc < 5 || columns < 1 || width < 1) {
    std::fprintf(stderr, "usage: %s OUT.jpg COLUMNS WIDTH FILE...\n", argv[0]);
    return 2;
  }
  try {
    write_text_atomically(argv[1], jpeg_bytes(contact_sheet(rows_of(argc, argv, columns, width))));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
  return 0;
}
