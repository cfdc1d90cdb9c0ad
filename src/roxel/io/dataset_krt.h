#pragma once
/// KRT text files, one a camera: 21 numbers, K (3 rows), R (3 rows), t, free of layout; lines that begin with
/// '#' are skipped. pixel ~ K (R x + t); the centre of the top-left pixel is (0.5, 0.5). NAME.krt or NAME.txt
/// belongs to the image NAME or NAME.SUFFIX.

#include <filesystem>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel {

/// The *.krt files in `path`/cameras, `path`/krt or `path`; without any, those *.txt files there that hold 21
/// numbers or have an image of their name. Sorted by name; of one folder only.
std::vector<std::filesystem::path> find_krt(const std::filesystem::path& path);

/// Views without size, masks and nodes (read_dataset adds them). Images: `path`/images, `path`, or beside the
/// file.
Dataset read_krt(const std::filesystem::path& path);

}  // namespace roxel
