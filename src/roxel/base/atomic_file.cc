#include "roxel/base/atomic_file.h"

#include <unistd.h>

#include <atomic>
#include <fstream>
#include <string>

#include "roxel/base/error.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

/// Unique among threads (counter) and processes (pid).
fs::path temporary_beside(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  const std::string tag = "." + std::to_string(getpid()) + "." + std::to_string(counter++) + ".tmp";
  return target.parent_path() / ("." + target.stem().string() + tag + target.extension().string());
}

/// Removes the temporary unless it has been renamed.
class Remover {
 public:
  explicit Remover(fs::path file) : file_(std::move(file)) {}
  Remover(const Remover&) = delete;
  Remover& operator=(const Remover&) = delete;
  ~Remover() {
    std::error_code ignored;
    if (!file_.empty()) fs::remove(file_, ignored);
  }
  void keep() { file_.clear(); }

 private:
  fs::path file_;
};

void make_folder(const fs::path& folder) {
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot make the folder (" + error.message() + ")");
}

}  // namespace

void write_file_atomically(const fs::path& target, const std::function<void(const fs::path&)>& write) {
  make_folder(target.parent_path());
  const fs::path temporary = temporary_beside(target);
  Remover remover(temporary);
  write(temporary);
  std::error_code error;
  fs::rename(temporary, target, error);
  if (error) throw IoError(target.string() + ": cannot be written (" + error.message() + ")");
  remover.keep();
}

void write_text_atomically(const fs::path& target, std::string_view text) {
  write_file_atomically(target, [&](const fs::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    out.close();
    if (!out) throw IoError(target.string() + ": writing failed (disc full, or no permission?)");
  });
}

}  // namespace roxel
