# Subdivision surfaces: counts, points, formats, posed models.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() {
  cd "$BATS_TEST_TMPDIR" || return
  upload "$samples/cube.obj"
  cube=/v1/models/$id
}

# points FILE: the number of points that a GLB's first primitive has.
points() { glb_json "$1" | gojq '.accessors[.meshes[0].primitives[0].attributes.POSITION].count'; }

# triangles FILE: of its first primitive.
triangles() { glb_json "$1" | gojq '.accessors[.meshes[0].primitives[0].indices].count / 3'; }

# obj_points FILE, obj_faces FILE: of an OBJ.
obj_points() { grep -c '^v ' "$1"; }
obj_faces() { grep -c '^f ' "$1"; }

# ---- counts --------------------------------------------------------------------------------------

@test "a cube has 26 points, 48 edges, 24 faces at level 1, and 98, 192, 96 at level 2" {
  get "$cube/surface.json"
  expect 200
  holds '.level == 1 and .vertices == 26 and .edges == 48 and .faces == 24'
  get "$cube/surface.json?level=2"
  holds '.level == 2 and .vertices == 98 and .edges == 192 and .faces == 96'
  holds '.meshes | length == 1'
  holds '.meshes[0] | .vertices == 98 and .edges == 192 and .faces == 96'
}

@test "a GLB holds as many points as the counts say, and as many bytes" {
  for level in 1 2 3 4; do
    get "$cube/surface.json?level=$level"
    vertices=$(value .vertices) faces=$(value .faces) bytes=$(value .bytes)
    get "$cube/surface.glb?level=$level"
    expect 200
    [ "$(header content-type)" = model/gltf-binary ]
    [ "$(points answer)" = "$vertices" ]
    [ "$(triangles answer)" = $((2 * faces)) ]
    [ "$(stat -c %s answer)" = "$bytes" ]
    [ "$(header content-length)" = "$bytes" ]
  done
}

# ---- forms ---------------------------------------------------------------------------------------

@test "the octopus keeps its texture coordinates, split at the seams only" {
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.json?level=2"
  welded=$(value .vertices)
  get "/v1/models/$id/surface.glb?level=2"
  expect 200
  glb_json answer | gojq -e '.meshes[0].primitives | all(.attributes | has("TEXCOORD_0") and has("NORMAL"))'
  drawn=$(points answer)
  [ "$drawn" -gt "$welded" ]
  [ "$drawn" -lt $((welded * 6 / 5)) ]
  get "/v1/models/$id/surface.obj?level=2"
  [ "$(obj_points answer)" = "$welded" ]
  [ "$(obj_faces answer)" = $((288 * 16)) ]
  grep -q '^vt ' answer
}

@test "the glTF form says the same as the GLB" {
  get "$cube/surface.glb?level=2"
  glb_json answer >glb.json
  tail -c +$((29 + $(od -An -tu4 -j12 -N4 answer))) answer >glb.bin
  get "$cube/surface.gltf?level=2"
  [[ $(header content-type) == model/gltf+json* ]]
  holds '.buffers[0].uri | startswith("data:application/")'
  diff <(gojq 'del(.buffers)' glb.json) <(gojq 'del(.buffers)' answer)
  value '.buffers[0].uri' | sed 's/^[^,]*,//' | base64 --decode >gltf.bin
  # The chunk of a GLB may end in up to three bytes of padding.
  cmp --bytes="$(stat -c %s gltf.bin)" gltf.bin glb.bin
  [ $(($(stat -c %s glb.bin) - $(stat -c %s gltf.bin))) -lt 4 ]
}

@test "a 3MF is a zip of three parts, whose length nobody knows beforehand" {
  get "$cube/surface.3mf?level=4"
  expect 200
  [ "$(header content-type)" = model/3mf ]
  [ -z "$(header content-length)$(header accept-ranges)" ]
  python3 -m zipfile --test answer
  python3 -m zipfile --extract answer parts
  [ "$(cd parts && find . -type f | sort)" = "$(printf '%s\n' ./3D/3dmodel.model './[Content_Types].xml' ./_rels/.rels)" ]
  [ "$(grep --only-matching '<vertex ' parts/3D/3dmodel.model | wc -l)" = 1538 ]
  [ "$(grep --only-matching '<triangle ' parts/3D/3dmodel.model | wc -l)" = 3072 ]
  post /v1/surface.3mf?level=4 "$samples/cube.obj"
  python3 -m zipfile --extract answer posted
  diff -r parts posted
  http HEAD "$cube/surface.3mf?level=9"
  expect 200
  [ -z "$(header content-length)" ]
}

@test "all levels are counted in one answer, the last one over a limit" {
  get "$cube/levels.json"
  expect 200
  cp answer levels
  for level in 0 3 9; do
    get "$cube/surface.json?level=$level"
    diff <(gojq -c "{level, vertices, edges, faces, bytes}" answer) <(gojq -c ".levels[$level] | del(.error)" levels)
  done
  gojq --exit-status '.levels[:-1] | all(has("refused") | not)' levels
  get "$cube/levels.json?retarget=auto"
  [[ $(header x-tweend-warning) == "1; retarget%3Dauto"* ]]
}

@test "points of a mesh are as many bytes as the head tells, also in parts" {
  get "$cube/surface.bin?level=3"
  expect 200
  cp answer whole
  [ "$(header content-length)" = "$(stat -c %s whole)" ]
  length=$(od -An -tu4 -j8 -N4 whole)
  tail -c +13 whole | head -c $((length)) | gojq --exit-status '.points == 386 and .stride == 3 and .level == 3'
  [ "$(stat -c %s whole)" = $((12 + length + 12 * 386)) ]
  post '/v1/surface.bin?level=3' "$samples/cube.obj"
  cmp answer whole
  http HEAD "$cube/surface.bin?level=3"
  [ "$(header content-length)" = "$(stat -c %s whole)" ]
  http GET "$cube/surface.bin?level=3" --range 100-999
  expect 206
  cmp answer <(tail -c +101 whole | head -c 900)
  http POST "$cube/detail?level=3" --data-binary @whole --header 'Content-Type: application/octet-stream'
  expect 200
  holds '.id == "'"${cube##*/}"'"'
}

@test "HEAD tells the size of a GLB and computes nothing" {
  get "$cube/surface.json?level=10"
  bytes=$(value .bytes)
  http HEAD "$cube/surface.glb?level=10" --max-time 20
  expect 200
  [ "$(header content-length)" = "$bytes" ]
}

@test "POST /v1/surface answers as the stored model would, and stores nothing" {
  get '/v1/models?limit=1000'
  cp answer before
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.glb?level=2&boundary=edge-only"
  cp answer stored.glb
  http DELETE "/v1/models/$id"
  post '/v1/surface.glb?level=2&boundary=edge-only' "$samples/octopus.obj"
  expect 200
  cmp answer stored.glb
  get "/v1/models/$id"
  problem 404
}

# ---- posed models --------------------------------------------------------------------------------

@test "clip and at pose the nodes of the GLB as pose says" {
  upload "$samples/tank.json"
  get "/v1/models/$id/pose.json?clip=drive&at=1.7&nodes=hull,turret,barrel"
  gojq -c '[.nodes, .poses[0].rotation] | transpose | map({key: .[0], value: .[1]}) | from_entries' answer >pose
  get "/v1/models/$id/surface.glb?level=1&clip=drive&at=1.7"
  expect 200
  glb_json answer >posed.json
  gojq -e '.animations == null' posed.json
  gojq -e --slurpfile pose pose '
    [.nodes[] | select(.name == "hull" or .name == "turret" or .name == "barrel")] |
    length == 3 and all(. as $node | [.rotation, $pose[0][$node.name]] | transpose | all((.[0] - .[1]) | fabs < 1e-6))' posed.json
}

@test "without clip all clips are kept, clip=none leaves them out, names with commas choose" {
  upload "$samples/tank.json"
  tank=/v1/models/$id
  gojq -c '[.clips[].name]' answer >clips
  gojq -e 'length >= 2' clips
  get "$tank/surface.glb?level=1"
  expect 200
  [ "$(glb_json answer | gojq -c '[.animations[].name]')" = "$(cat clips)" ]
  all=$(header etag)
  get "$tank/surface.glb?level=1&clip=$(gojq -r 'join(",")' clips)"
  [ "$(header etag)" = "$all" ]
  get "$tank/surface.glb?level=1&clip=none"
  glb_json answer | gojq -e 'has("animations") == false'
  get "$tank/surface.glb?level=1&clip=aim,drive"
  [ "$(glb_json answer | gojq -c '[.animations[].name]')" = '["aim","drive"]' ]
  get "$tank/pose.json?clip=aim,drive&at=1"
  holds '.clip == "aim,drive"'
  get "$tank/surface.glb?clip=aim,dance"
  problem 404 dance
}

@test "X-Tweend-Warning tells what a model's warnings say first" {
  printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 1 2\n' >narrow.obj
  upload narrow.obj
  jq -r '.warnings[0] | @uri' answer >first # gojq escapes more
  get "/v1/models/$id/surface.glb"
  expect 200
  [ "$(header x-tweend-warning)" = "1; $(cat first)" ]
}

@test "clip alone keeps the clip as an animation" {
  upload "$samples/tank.json"
  get "/v1/models/$id/surface.glb?level=1&clip=aim"
  expect 200
  glb_json answer | gojq -e '(.animations | length) == 1 and .animations[0].name == "aim" and
    ([.animations[0].channels[].target.path] | unique) == ["rotation"]'
}

@test "the tank's surface has a mesh for each of its meshes and a node for each of its nodes" {
  upload "$samples/tank.json"
  get "/v1/models/$id/surface.json?level=2"
  holds '.meshes | length == 5'
  holds '.faces == ([.meshes[].faces] | add)'
  get "/v1/models/$id/surface.glb?level=2"
  glb_json answer | gojq -e '(.meshes | length) == 5 and (.nodes | length) == 9 and .asset.version == "2.0"'
}

@test "times bake keys, a tolerance leaves few, meshes=none leaves the animation" {
  upload "$samples/tank.json"
  tank=/v1/models/$id
  get "$tank/surface.glb?level=0&clip=drive&from=0&to=4&fps=2"
  expect 200
  glb_json answer | gojq -e '. as $g | [.animations[0].samplers[].input] | unique | all($g.accessors[.] | .count == 9 and .min == [0] and .max == [4])'
  awk -F"[=,]" "{ exit !(\$2 > 1 && \$2 <= 180) }" <<<"$(header x-tweend-error)"
  get "$tank/surface.glb?meshes=none&clip=drive"
  expect 200
  [[ $(header x-tweend-error) =~ ^degrees=0\.0[0-9]+,\ metres=0\.0+$ ]]
  kept=$(header content-length)
  glb_json answer | gojq -e 'has("meshes") == false and (.nodes | length) == 9 and (.animations | length) == 1'
  get "$tank/surface.glb?meshes=none&clip=drive&tolerance=2&tolerance_m=0.1"
  expect 200
  (($(header content-length) <= kept))
  awk -F"[=,]" "{ exit !(\$2 > 0.1 && \$2 <= 2) }" <<<"$(header x-tweend-error)"
  get "$tank/surface.glb?level=1&at=1&skin=bake"
  expect 200
}

@test "a reduced clip that is uploaded again moves within the error that was told" {
  upload "$samples/tank.json"
  times=$(seq -s, 0 0.05 4)
  get "/v1/models/$id/pose?clip=drive&at=$times"
  cp answer before
  for tolerance in 0.5 2 10 90; do
    get "/v1/models/$id/surface.glb?meshes=none&clip=drive&tolerance=$tolerance"
    told=$(header x-tweend-error | sed 's/degrees=\([^,]*\),.*/\1/')
    tank=$id
    cp answer reduced.glb
    upload reduced.glb
    get "/v1/models/$id/pose?clip=drive&at=$times"
    gojq -e --slurpfile before before --argjson told "$told" '
      [.poses, $before[0].poses] | transpose | map(map(.rotation) | transpose[] | transpose | map(.[0] * .[1]) | add | fabs
        | [., 1] | min | 2 * acos * 180 / 3.14159265) | max < $told + 0.1' answer
    get "/v1/models/$id/tracks?clip=drive"
    holds '[.tracks[] | .half_turns + .steps_over_180] | add == 0'
    id=$tank
  done
}

# ---- refusals ------------------------------------------------------------------------------------

@test "values that do not fit are refused by the parameter's name" {
  for query in level=-1 level=x level=1.5 level= level=99999999999999999999 boundary=closed scheme=doo-sabin normals=flat; do
    get "$cube/surface.glb?$query"
    problem 400 "${query%%=*}"
  done
}

@test "Loop's scheme takes triangles of STL and glTF as they are" {
  upload "$samples/cube.obj"
  for form in stl glb; do
    get "/v1/models/$id/surface.$form?level=0"
    cp answer "cube.$form"
  done
  for form in stl glb; do
    upload "cube.$form"
    get "/v1/models/$id/surface.json?level=2&scheme=loop"
    expect 200
    [ "$(value .faces)" = $((12 * 16)) ]
    get "/v1/models/$id/surface.json?level=2&scheme=loop&quads=auto"
    expect 422
  done
}

@test "a texture without any member stays an object" {
  printf '%s' '{"asset":{"version":"2.0"},"textures":[{}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}' >bare.gltf
  post "/v1/surface.gltf?level=1" bare.gltf
  holds '.textures | map(type) == ["object"]'
}

@test "level=auto tells the level that an error needs, HEAD too" {
  get "$cube/surface.stl?level=auto&error=0.02"
  expect 200
  [ "$(header x-tweend-level)" = 3 ]
  [[ "$(header x-tweend-error)" == surface=0.0* ]]
  etag=$(header etag)
  cp answer auto.stl
  get "$cube/surface.stl?level=3"
  cmp answer auto.stl
  http HEAD "$cube/surface.stl?level=auto&error=0.02"
  expect 200
  [ "$(header x-tweend-level)" = 3 ]
  [ "$(header etag)" = "$etag" ]
  get "$cube/surface.stl?level=auto&error=1%25"
  expect 200
  get "$cube/surface.json?level=auto&faces=400"
  expect 200
  gojq --exit-status '.faces == 384 and .level == 3 and .error > 0 and .forms.bin > 0' answer
  get "$cube/levels.json"
  gojq --exit-status '[.levels[].error] | . == (sort | reverse) and (.[0] > 0.8)' answer
  get "$cube/surface.glb?level=auto&error=1e-9"
  expect 422
  get "$cube/surface.glb?level=2&error=1"
  expect 400
  get "$cube/surface.glb?level=auto&error=none"
  expect 400
}
