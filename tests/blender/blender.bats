# What Blender exports comes back into Blender, surfaces are those of its own modifier, edits those of its operators, BVH
# moves there as here.

# shellcheck disable=SC2154 # the helper sets them
load ../e2e/helper

setup_file() {
  export made=$BATS_FILE_TMPDIR/made
  mkdir -p "$made"
  in_blender scene.py "$made"
  in_blender plain.py "$made"
  start_daemon
  cd "$made" || return
  upload figure.glb
  export model=/v1/models/$id
}
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# in_blender SCRIPT ARGUMENT...
in_blender() {
  blender --background --factory-startup --python-exit-code 1 --python "$root/tests/blender/$1" -- "${@:2}" >"$BATS_FILE_TMPDIR/blender.log" 2>&1 ||
    { tail -n 30 "$BATS_FILE_TMPDIR/blender.log"; return 1; }
}

# expected JQ-EXPRESSION: of what Blender said when the figure was made.
expected() { gojq --raw-output "$1" "$made/expected.json"; }

# look FILE: what Blender says of it, in the file answer.
look() {
  in_blender look.py "$(realpath "$1")" "$made/expected.json"
  grep '^{' "$BATS_FILE_TMPDIR/blender.log" >answer
}

@test "the description counts quads, hard edges and clips as Blender does" {
  get "$model"
  expect 200
  holds "[.clips[].name] == $(expected '.clips | tojson')"
  holds ".meshes[0].hard_edges.normals == $(expected .hard_edges)"
  get "$model/surface.json?level=0&quads=auto"
  holds ".faces == $(expected .faces) and .vertices == $(expected .vertices)"
}

@test "surfaces have the points of Blender's own modifier" {
  for level in 1 2 3; do
    get "$model/surface.obj?level=$level&quads=auto&creases=normals"
    expect 200
    [[ $(grep -c '^f ' answer) == $(expected ".surfaces[\"$level\"].faces") ]]
    node "$root/tests/blender/nearest.mjs" answer "$made/expected.json" "surfaces.$level.points"
  done
}

@test "bones and shape keys together move the points as Blender moves them" {
  for key in 0 1 2; do
    get "$model/surface.obj?level=0&quads=auto&clip=bend,grow&skin=bake&at=$(expected ".moved[$key].time")"
    expect 200
    node "$root/tests/blender/nearest.mjs" answer "$made/expected.json" "moved.$key.points"
  done
}

@test "Blender sees in the cage what it sees in its own export" {
  look "$made/figure.glb"
  mv answer before
  get "$model/surface.glb?level=0"
  mv answer cage.glb
  look cage.glb
  for what in objects bones shape_keys actions materials uv_maps triangles; do
    holds ".$what == $(gojq -c ".$what" before)"
  done
  holds ".bones == $(expected '.bones | tojson') and .shape_keys == $(expected '.shape_keys | tojson')"
  holds "[.bounds, $(gojq -c .bounds before)] | [.[] | flatten] | transpose | all((.[0] - .[1] | fabs) < 1e-5)"
  holds '.off < 1e-5'
}

@test "Blender opens the surface, skinned, with shape keys and both clips" {
  look "$made/figure.glb"
  mv answer before
  get "$model/surface.glb?level=2&quads=auto&creases=normals"
  mv answer surface.glb
  look surface.glb
  for what in objects bones shape_keys actions materials uv_maps; do
    holds ".$what == $(gojq -c ".$what" before)"
  done
  holds ".triangles == 2 * $(expected '.surfaces["2"].faces')"
}

@test "quads that Blender's export split come back, and triangles stay" {
  for figure in suzanne rod worn; do
    upload "$made/$figure.glb"
    get "/v1/models/$id/surface.obj?level=0&quads=auto"
    expect 200
    read -r quads right others < <(node "$root/tests/blender/quads.mjs" answer "$made/quads.json" "$figure")
    echo "$figure: $right of $quads quads, and $others others"
    ((right >= quads * 99 / 100 && others <= 4))
    get "/v1/models/$id"
    holds ".meshes[0].paired_quads == $((right + others))"
  done
}

@test "shapes and edits are those that Blender's operators make" {
  in_blender edits.py "$BATS_TEST_TMPDIR"
  node "$root/tests/blender/edits.mjs" "$url" edits.json
}

@test "joints of BVH files are where poses have them: read by Blender, written for it, and exported by it" {
  node "$root/tests/blender/bvh.mjs" make "$url"
  in_blender bvh.py "$BATS_TEST_TMPDIR"
  node "$root/tests/blender/bvh.mjs" compare "$url"
}

@test "Blender reads the triangles of the GLB from STL and PLY, with its shells, volume and bounds" {
  for sample in cube.obj octopus.obj; do
    upload "$root/server/samples/$sample"
    for level in 0 1 2 3 4; do
      for form in glb stl ply; do
        get "/v1/models/$id/surface.$form?level=$level$([[ $form == glb ]] || echo '&unit=m')"
        expect 200
        mv answer "$sample.$level.$form"
      done
    done
  done
  in_blender prints.py ./*.obj.*
  grep '^{' "$BATS_FILE_TMPDIR/blender.log" >answer
  gojq --slurp --compact-output 'group_by(.file | sub("[.][a-z]*$"; "")) | .[]' answer >groups
  [[ $(wc -l <groups) == 10 ]]
  while read -r group; do
    echo "$group"
    gojq --exit-status "first(.[] | select(.file | endswith(\"glb\"))) as \$glb | length == 3 and all(.[];
      [.triangles, .open, .shells] == [\$glb.triangles, \$glb.open, \$glb.shells] and
      (.volume / \$glb.volume - 1 | fabs) < 1e-6 and
      ([.bounds, \$glb.bounds] | [.[] | flatten] | transpose | all(.[0] - .[1] | fabs < 1e-6))) and
      (\$glb.open == 0 or (\$glb.file | startswith(\"octopus\")))" <<<"$group" >/dev/null # whose cage is open
  done <groups
}
