#pragma once
/// Files appear whole or not at all: they are written under a temporary name in the folder of the target
/// and renamed when they are complete, so that a reader, or a later run, never meets half a file.

#include <filesystem>
#include <functional>
#include <string_view>

namespace roxel {

/// Calls write(temporary) and renames what it wrote to `target`, replacing a file of that name. The
/// temporary name keeps the suffix of the target (libraries choose formats by it) and starts with a dot.
/// Missing folders are made. When `write` throws, its exception passes through; when it wrote nothing, or a
/// folder or the rename fails, this throws IoError. In each case the temporary is removed and an older
/// target is left as it was. (It guards against interruption, not against power failure: no fsync.)
void write_file_atomically(const std::filesystem::path& target,
                           const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for content that is at hand.
void write_text_atomically(const std::filesystem::path& target, std::string_view text);

}  // namespace roxel
