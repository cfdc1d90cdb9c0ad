#include "roxel/report/light_measures.h"

#include "roxel/base/formatted.h"

namespace roxel {

nlohmann::ordered_json to_json(const std::vector<LightMeasure>& light) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const LightMeasure& m : light) {
    nlohmann::ordered_json albedo = nullptr;
    if (m.albedo.pixels > 0)
      albedo = {{"pixels", m.albedo.pixels},
                {"mean_log_error", m.albedo.mean},
                {"median_log_error", m.albedo.median}};
    list.push_back({{"light", m.name},
                    {"shared_places", m.shared_places},
                    {"places", m.spread.places},
                    {"mean_spread", m.spread.mean},
                    {"median_spread", m.spread.median},
                    {"albedo", albedo}});
  }
  return list;
}

std::string csv_table(const std::vector<LightMeasure>& light) {
  std::string csv =
      "light,shared_places,places,mean_spread,median_spread,albedo_pixels,mean_albedo_error,median_albedo_"
      "error\n";
  for (const LightMeasure& m : light)
    csv += formatted("%s,%lld,%lld,%.6g,%.6g,%lld,%.6g,%.6g\n", m.name.c_str(),
                     static_cast<long long>(m.shared_places), static_cast<long long>(m.spread.places),
                     m.spread.mean, m.spread.median, static_cast<long long>(m.albedo.pixels), m.albedo.mean,
                     m.albedo.median);
  return csv;
}

std::string to_text(const std::vector<LightMeasure>& light) {
  if (light.empty()) return "";
  std::string text =
      "| photographs over | places of those shared | log colour: spread between nodes, mean | median | off "
      "albedo, mean | "
      "median |\n"
      "|---|---:|---:|---:|---:|---:|\n";
  for (const LightMeasure& m : light) {
    text += formatted("| %s | %lld of %lld | %.3f | %.3f |", m.name.c_str(),
                      static_cast<long long>(m.spread.places), static_cast<long long>(m.shared_places),
                      m.spread.mean, m.spread.median);
    text += m.albedo.pixels > 0 ? formatted(" %.3f | %.3f |\n", m.albedo.mean, m.albedo.median)
                                : std::string(" - | - |\n");
  }
  return text + "\n";
}

}  // namespace roxel
