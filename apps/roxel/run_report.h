#pragma once
/// The page of a finished run, drawn again from what lies in its folder.

#include "common.h"
#include "depth_files.h"
#include "roxel/report/run_record.h"

namespace roxel::cli {

/// A run whose page is drawn again.
struct RunReportSource {
  const FinishedRun& run;
  const Input& input;
  DepthFolders folders;                   ///< depth/, render/ and error/ are looked for in these
  const nlohmann::ordered_json& summary;  ///< the new one
};

/// Whether the run has a page.
bool has_report(const FinishedRun& run);

/// The pictures of the mesh that lies in a run's folder; no views where there are none.
ReportMesh mesh_pictures_of(const std::filesystem::path& run);

/// The photograph of a view over the run's light (over_light); empty where the run divides nothing out.
Image over_light_of(const FinishedRun& run, const Dataset& dataset, const View& view, const Image& photo);

/// Skies for a page: those of `results`, or of the run that the summary says they were taken from.
void add_skies(const std::filesystem::path& results, ReportContent& content);

/// Writes folders.results/report.html. Pictures that a run was made without are left out.
void write_run_report(const RunReportSource& source, ReportMesh mesh, const RunContext& context);

}  // namespace roxel::cli
