#pragma once
/// COLMAP models as COLMAP writes them: cameras, images and points3D, as .bin or as .txt.
/// x_in_camera = R(qvec) x + tvec; the centre of the top-left pixel is (0.5, 0.5), as in roxel.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel {

struct ColmapImage {
  int id = 0;
  int camera_id = 0;
  std::string name;    ///< path below the image folder
  std::string source;  ///< "file:line" or "file: image 3 of 15"
  Pose pose;
};

struct ColmapModel {
  std::map<int, Lens> cameras;  ///< by id
  std::vector<ColmapImage> images;
  std::vector<Eigen::Vector3d> points;
  std::vector<int> point_view_counts;  ///< track lengths, as many as points
};

/// The folder with the model: `path`/sparse/0, `path`/sparse or `path` itself; empty where none has one.
std::filesystem::path find_colmap_model(const std::filesystem::path& path);

/// Reads the .bin files of `folder`, or the .txt files where there is no .bin. Points may be absent. Throws
/// InvalidInput for anything that is broken, an image whose camera does not exist among it.
ColmapModel read_colmap_model(const std::filesystem::path& folder);

/// Views (image path, name, lens, pose), points and warnings; masks, sizes and nodes are left to
/// read_dataset.
Dataset read_colmap(const std::filesystem::path& path);

/// A camera from its model's name, as in cameras.txt, and its parameters in COLMAP's order.
Lens colmap_lens(const std::string& model_name, int width, int height, const std::vector<double>& parameters,
                 const std::string& where);

/// The model's name for the id that binary files use. Throws for an id that COLMAP does not have.
std::string colmap_model_name(int model_id, const std::string& where);

/// Number of parameters of a model. Throws InvalidInput for an unknown name.
std::size_t colmap_parameter_count(const std::string& model_name, const std::string& where);

/// COLMAP's parameters of a lens: its own order, one focal length where the model has one.
std::vector<double> colmap_parameters(const Lens& lens);

/// Parsers of one file each; the binary ones are in dataset_colmap_binary.cc.
std::map<int, Lens> read_colmap_cameras_text(const std::filesystem::path& file);
std::vector<ColmapImage> read_colmap_images_text(const std::filesystem::path& file);
void read_colmap_points_text(const std::filesystem::path& file, ColmapModel& model);
std::map<int, Lens> read_colmap_cameras_binary(const std::filesystem::path& file);
std::vector<ColmapImage> read_colmap_images_binary(const std::filesystem::path& file);
void read_colmap_points_binary(const std::filesystem::path& file, ColmapModel& model);

}  // namespace roxel
