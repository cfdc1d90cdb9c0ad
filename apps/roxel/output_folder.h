#pragma once
/// Where a command writes: never over what it reads, and in the place of older results only when the new ones
/// are whole.

#include <filesystem>
#include <functional>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel::cli {

/// What a command reads, and so must not write into.
struct Sources {
  std::vector<std::filesystem::path> folders;  ///< runs and truth
  const Dataset* dataset = nullptr;            ///< its path as it was given, or absolute
};

/// Throws InvalidInput where `output` is a folder of `sources`, or has an image or mask somewhere below it.
/// Links are followed, also those that stand for the folders that results go to (`output`/depth, ...).
void protect_sources(const std::filesystem::path& output, const Sources& sources);

/// A folder that results go to. It is made, and tried by writing, before any long work; folders that were
/// made and are still empty in the end are removed.
class OutputFolder {
 public:
  /// Throws InvalidInput where a file is in the way, IoError where the folder cannot be made or written to.
  explicit OutputFolder(std::filesystem::path path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::vector<std::filesystem::path> made_;  ///< outermost first
};

/// Results in the making: a hidden folder in the one that they are for. It is removed in the end, and what
/// was not published with it.
class PartialResults {
 public:
  /// Throws IoError.
  explicit PartialResults(const std::filesystem::path& target);
  ~PartialResults();
  PartialResults(const PartialResults&) = delete;
  PartialResults& operator=(const PartialResults&) = delete;
  const std::filesystem::path& path() const { return path_; }

  /// Calls remove_older() and moves all files to the target, summary.json last. Throws IoError before that
  /// where something is in their way.
  void publish(const std::function<void()>& remove_older = [] {});
  /// Moves all files over those that there are, summary.json last, and then removes those of the `older` ones
  /// in whose place none has come: whatever fails on the way, no file is lost before there is a new one.
  void publish_over(const std::vector<std::string>& older);

 private:
  std::vector<std::filesystem::path> files() const;
  void make_way(const std::vector<std::filesystem::path>& names) const;
  void move_all(const std::vector<std::filesystem::path>& names) const;

  std::filesystem::path target_, path_;
};

}  // namespace roxel::cli
