# Root motion: taken out of poses, streams and files, told beside them or dropped.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# Slides 4 m along z within 2 s, rises by 1 m, and turns by 90 degrees. The place at first, (1, 1, 0), is turned to (0, 1, -1):
# from there to (1, 2, 4) it is (1, 1, 5).
walk='{"name":"walk","tracks":[{"node":"hips","path":"translation","times":[0,2],"values":[[1,1,0],[1,2,4]]},
  {"node":"hips","path":"rotation","times":[0,2],"axis_angles":[[0,1,0,0],[0,1,0,90]],"unit":"degrees"}]}'
slow='{"name":"slow","layers":[{"clip":"walk","speed":0.5}]}'
hips='{"name":"hips"},{"name":"head","parent":"hips","translation":[0,1,0]}'
solid='{"name":"solid","positions":[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],"faces":[[0,2,1],[0,1,3],[1,2,3],[0,3,2]]}'

# model NODES CLIPS [MESHES]: stores it; sets $model to its path.
model() {
  printf '{"nodes":[%s],"clips":[%s],"meshes":[%s]}' "$1" "$2" "${3-}" >model.json
  upload model.json
  model=/v1/models/$id
}

# moved [PATH]: the motion at PATH is the one above, on the default axes.
moved() { holds "${1-.poses[0].root} | (.translation | map(. * 1000 | round)) == [1000, 0, 5000] and (.rotation | map(. * 1000 | round)) == [0, 707, 0, 707]"; }

@test "the motion stands beside each pose, and is no longer in it" {
  model "$hips" "$walk"
  get "$model/pose.json?at=2&root_motion=auto"
  moved
  holds '.poses[0] | (.translation[0] | map(. * 1000 | round)) == [1000, 2000, 0] and (.rotation[0] | map(. * 1000 | round)) == [0, 0, 0, 1000]'
}

@test "root_axes choose, in_place drops, and both are in the entity tag" {
  model "$hips" "$walk"
  declare -A tags=()
  for query in '' root_motion=auto root_motion=head 'root_motion=auto&root_axes=z' 'root_motion=auto&in_place=true' 'in_place=true&root_axes=y'; do
    get "$model/pose.json?at=2&$query"
    [[ -z ${tags[$(header etag)]-} ]]
    tags[$(header etag)]=$query
    has_root=true
    [[ $query == root_motion* && $query != *in_place* ]] || has_root=false
    holds ".poses[0] | has(\"root\") == $has_root"
  done
  holds '.poses[0].translation[0] | map(. * 1000 | round) == [1000, 1000, 4000]'
}

@test "live streams, lines and posted times tell it too; text without a place for it refuses" {
  model "$hips" "$walk"
  { curl --silent --no-buffer --max-time 5 "$url$model/live?root_motion=auto&loop=clamp&from=2&fps=5" || true; } |
    sed -un 's/^data: //p' | grep -m 1 '"root"' >answer
  moved .root
  get "$model/pose.ndjson?at=2&root_motion=auto"
  moved .root
  http POST "$model/pose.json?root_motion=auto" --json '{"times": [2]}'
  moved
  for form in csv bvh; do
    get "$model/pose.$form?root_motion=auto"
    problem 400 in_place
    get "$model/pose.$form?in_place=true"
    expect 200
  done
}

@test "tracks tell what came together, and judge the clip without it" {
  model "$hips" "$walk"
  get "$model/tracks?root_motion=hips"
  moved .root_motion
  holds '.root_motion.node == "hips" and .root_motion.axes == "x,z,yaw" and .report.root.turn < 0.01'
  get "$model/tracks?root_motion=hips&root_axes=yaw,z"
  holds '.root_motion.axes == "z,yaw" and .root_motion.translation[0] == 0'
}

@test "a moment of a surface shows the motion, in place it does not" {
  model '{"name":"hips","mesh":"solid"}' "$walk" "$solid"
  for query in '' root_motion=auto in_place=true; do
    get "$model/surface.obj?level=0&at=2&$query"
    deepest=$(awk '$1 == "v" && $4 > most { most = $4 } END { printf "%.3f", most }' answer)
    [[ $deepest == "$([[ $query == in_place* ]] && echo 1.000 || echo 4.000)" ]]
  done
}

@test "mixed and borrowed clips have root motion, in files as tracks of the topmost node" {
  model '{"name":"hips","mesh":"solid"}' "$walk,$slow" "$solid"
  get "$model/pose.json?clip=slow&at=4&root_motion=auto"
  moved
  get "$model/surface.gltf?level=0&clip=walk,slow&root_motion=auto"
  expect 200
  holds '(.nodes | map(.name)) as $names | ($names | index("root")) as $root
    | .nodes[$root].children == [$names | index("hips")] and (.animations | length) == 2
    and all(.animations[]; any(.channels[]; .target == {"node": $root, "path": "translation"}))'
  lender=$id
  model "$hips" ''
  get "$model/pose.json?clip=$lender/walk&at=2&root_motion=auto"
  moved
}

@test "a clip that neither moves nor turns a node stays as it is" {
  model "$hips" "$walk"',{"name":"grow","tracks":[{"node":"head","path":"scale","times":[0,1],"values":[[1,1,1],[2,2,2]]}]}'
  get "$model/surface.gltf?level=0&root_motion=auto"
  holds '[.animations[].name] == ["walk", "grow"] and .animations[1].channels[0].target == {"node": 1, "path": "scale"}'
  get "$model/tracks?clip=grow&root_motion=auto"
  holds '.other_tracks == [{"node": "head", "path": "scale", "interpolation": "linear", "keys": 2, "times": [0, 1]}] and (has("root_motion") | not)'
}

@test "what cannot be is refused with the reason" {
  model "$hips" "$walk"
  for query in root_axes=x 'root_motion=auto&root_axes=x,x' 'root_motion=auto&root_axes=pitch' 'root_motion=auto&root_axes=' in_place=maybe; do
    get "$model/pose.json?$query"
    problem 400
  done
  get "$model/pose.json?root_motion=hip"
  problem 404 'no node is called "hip".*hips'
  model "$hips" '{"name":"rest","tracks":[]}'
  get "$model/pose.json?root_motion=auto"
  holds '.warnings == ["the clip moves no node: there is no root motion"]'
  model '{"name":"a","scale":[1,2,1]},{"name":"hips","parent":"a"}' "$walk"
  get "$model/pose.json?root_motion=auto"
  problem 422 root_axes
  get "$model/pose.json?root_motion=auto&root_axes=x,z"
  expect 200
}
