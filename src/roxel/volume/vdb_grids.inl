// How .cc files make OpenVDB's grids and trees: by name, from OpenVDB's registry. A file that calls a
// constructor compiles the whole tree anew, which takes ten seconds; this takes none.
#pragma once

#include <openvdb/openvdb.h>

namespace roxel {

/// An empty grid; its transform is that of voxels.
template <class Grid>
typename Grid::Ptr make_grid(const typename Grid::ValueType& background = {}) {
  openvdb::initialize();
  auto grid = openvdb::gridPtrCast<Grid>(openvdb::GridBase::createGrid(Grid::gridType()));
  grid->tree().root().setBackground(background, /*updateChildNodes=*/false);
  return grid;
}

/// An empty tree of such a grid.
template <class Grid>
typename Grid::TreeType::Ptr make_tree(const typename Grid::ValueType& background = {}) {
  return make_grid<Grid>(background)->treePtr();
}

}  // namespace roxel
