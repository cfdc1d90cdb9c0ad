#pragma once
/// RUN/summary.json: what was done, why it stopped and what it cost; and what later commands need to know of
/// a run. docs/format.md lists the keys.

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roxel/dataset/dataset.h"
#include "roxel/io/volume_file.h"
#include "roxel/solve/reconstruct.h"

namespace roxel {

/// The `format` of summary.json, of reconstructions and of `roxel sky`.
inline constexpr int kSummaryFormat = 1;

/// What is reported of one view. RMS in percent of full scale over the pixels that show the object.
struct ViewFigures {
  std::string name;
  std::string hash;                        ///< of the image file
  std::optional<double> reprojection_rms;  ///< percent; none where nothing was rendered
  std::int64_t object_pixels = 0;
  std::optional<double> depth_share;  ///< of all pixels: opacity > 1/2; none where depth was not made
};

/// All that summary.json holds.
struct RunRecord {
  std::string command_line;
  std::string dataset_path;
  std::string dataset_format;
  std::string dataset_hash;
  int nodes = 0;
  nlohmann::ordered_json options;  ///< as used, by long name
  int threads = 1;
  Scene scene;
  LatticeFrame frame;  ///< of the box
  Summary summary;
  std::vector<std::string> warnings;
  std::vector<nlohmann::ordered_json> skies_again;  ///< what unexplained rays did to each sky
  std::vector<nlohmann::ordered_json> skies;        ///< as roxel sky reports them, where they were fitted
  std::vector<ViewFigures> views;
  std::optional<double> reprojection_rms;  ///< percent, over all views together
  nlohmann::ordered_json mesh;             ///< what was made of the surface; null: none
};

nlohmann::ordered_json to_json(const RunRecord& record);

/// One of its "stages".
nlohmann::ordered_json to_json(const StageRecord& stage);

/// Adds what `view` is: camera, lens and hash of the image file. Order matters.
void add_to_hash(const View& view, const std::string& file_hash, std::string& combined);

/// A finished run as later commands see it.
struct FinishedRun {
  std::filesystem::path path;
  nlohmann::json summary;
  VolumeFile file;

  /// The option of that name as it was used, or null.
  const nlohmann::json& option(const std::string& name) const;
};

/// Throws InvalidInput where the folder is no finished run.
nlohmann::json read_summary(const std::filesystem::path& run);
FinishedRun read_run(const std::filesystem::path& run);

[[noreturn]] void throw_damaged_summary(const std::filesystem::path& run, const std::string& why);

/// What read() makes of the summary of `run`; throws InvalidInput naming RUN/summary.json where a value is
/// not of the kind that it should be.
template <class Read>
auto read_from_summary(const std::filesystem::path& run, const Read& read) {
  try {
    return read();
  } catch (const nlohmann::json::exception& error) {
    throw_damaged_summary(run, error.what());
  }
}

/// The light that the run divided out of its photographs, for the views of `dataset` by name (1 for others).
/// Throws InvalidInput for a damaged summary.
Light light_of_run(const FinishedRun& run, const Dataset& dataset);

/// Removes the files of an earlier run that its summary.json lists, summary.json first, so that results of
/// two runs never mix. Does nothing where there is no summary.
void remove_results(const std::filesystem::path& run);

/// The files that a run has for a view: kinds "depth", "render" and "error" below the run.
std::filesystem::path view_path(const std::filesystem::path& run, const std::string& kind,
                                const std::string& name, const std::string& suffix);

}  // namespace roxel
