#pragma once
/// Where the files of a data set are.

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

namespace roxel {

/// Plain files in `folder` whose name ends in one of `endings`, sorted by name; none where there is no such
/// folder. Throws InvalidInput for a name of these that is not UTF-8.
std::vector<std::filesystem::path> files_ending_in(const std::filesystem::path& folder,
                                                   std::initializer_list<const char*> endings);

/// Whether the name ends in a suffix of an image format that photographs come in (.png, .jpg, .tif, .exr,
/// ...).
bool has_image_suffix(const std::string& name);

/// Plain files in `folder` with such a suffix, sorted by name.
std::vector<std::filesystem::path> image_files(const std::filesystem::path& folder);

/// `folder`/`name` where that exists, else `folder`/images/`name` where that does; absolute.
std::filesystem::path image_beside(const std::filesystem::path& folder, const std::string& name);

/// A short list of what is in `folder`, for messages: "3 entries (a.txt, b.png, c/)".
std::string describe_folder(const std::filesystem::path& folder);

/// The mask of an image by convention: FOLDER/NAME.png or FOLDER/NAME.SUFFIX.png (or another image suffix
/// in place of .png); empty where there is none. `relative_image` is the path below the image root.
std::filesystem::path mask_in_folder(const std::filesystem::path& folder, const std::string& relative_image);

}  // namespace roxel
