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
echo "== photographs of a synthetic world -> $folder/photographs"
"$roxel" synth demo -o "$folder/photographs"
echo "== reconstruction -> $folder/run"
"$roxel" reconstruct "$folder/photographs" -o "$folder/run"

first() { find "$1" -name "*.$2" 2>/dev/null | sort | head -n 1; }
echo
echo "Done. Compare, for the first camera:"
echo "  photograph        $(first "$folder/photographs" png)"
echo "  volume rendered   $(first "$folder/run/render" png)"
echo "  difference        $(first "$folder/run/error" png)"
echo "  depth             $(first "$folder/run/depth" exr)"
echo "All cameras: $folder/run/render, $folder/run/error, $folder/run/depth"
echo "What was done and what it cost: $folder/run/summary.json"
