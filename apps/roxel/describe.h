#pragma once
/// What `roxel info` and `roxel reconstruct --dry-run` say about a data set.

#include <nlohmann/json.hpp>
#include <string>

#include "common.h"
#include "roxel/depth/depth_stage.h"
#include "roxel/solve/options.h"

namespace roxel::cli {

struct Description {
  std::string text;
  nlohmann::ordered_json json;
};

Description describe(const Input& input, const ReconstructOptions& options, const DepthStageOptions& depth,
                     RunContext& context);

}  // namespace roxel::cli
