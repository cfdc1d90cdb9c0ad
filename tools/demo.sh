#!/bin/sh
# Makes a small synthetic world with exact cameras, reconstructs it, and says where the pictures are.
#
#     tools/demo.sh path/to/roxel [FOLDER]
set -eu

roxel=$1
folder=${2:-demo}
if [ ! -x "$roxel" ]; then
  echo "demo: $roxel is not built; run: make demo" >&2
  exit 1
fi

mkdir -p "$folder"
echo "== photographs of a synthetic world -> $folder/head"
"$roxel" synth head -o "$folder/head"
echo "== reconstruction -> $folder/run"
"$roxel" reconstruct "$folder/head" -o "$folder/run" --resolution 128

echo "== measured against the truth -> $folder/metrics"
"$roxel" eval "$folder/run" --truth "$folder/head" -o "$folder/metrics"

first() { find "$1" -name "*.$2" | sort | head -n 1; }
echo
echo "Look at $folder/metrics/report.html (and $folder/run/overview.png: photograph, rendered volume, depth, error)."
echo
echo "For the first camera:"
echo "  photograph        $(first "$folder/head/images" png)"
echo "  volume rendered   $(first "$folder/run/render" png)"
echo "  error             $(first "$folder/run/error" png)"
echo "  depth             $(first "$folder/run/depth" png)"
echo "The surface: $folder/run/mesh.glb (textured), mesh.ply; pictures $folder/run/mesh_views.png, mesh_turntable.jpg"
echo "The volume for Blender or vdb_view: $folder/run/volume.vdb"
echo "What was done and what it cost: $folder/run/summary.json"
