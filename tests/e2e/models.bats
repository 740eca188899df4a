# Uploading, describing, listing, reading back and deleting models.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# Any of these tests may run first: models differ by a comment, so that each test has its own.
own() { { cat "$1"; echo "# $BATS_TEST_NAME"; } >own.obj; }

@test "an upload answers 201 with the model's address and description" {
  own "$samples/cube.obj"
  http POST /v1/models --data-binary @own.obj --header 'Content-Type: model/obj'
  expect 201
  [ "$(value .id)" = "$(sha256sum own.obj | head -c 32)" ]
  [ "$(header location)" = "/v1/models/$(value .id)" ]
  [[ $(header etag) == \"*\" ]]
  holds '.format == "obj" and .name == "cube" and (.warnings | type) == "array"'
  holds ".bytes == $(stat -c %s own.obj)"
}

@test "the same bytes again are the same model: 201, then 200" {
  own "$samples/cube.obj"
  post /v1/models own.obj
  expect 201
  first=$(value .id)
  post /v1/models own.obj
  expect 200
  [ "$(value .id)" = "$first" ]
  get '/v1/models?limit=1000'
  holds "[.models[] | select(.id == \"$first\")] | length == 1"
}

@test "a tank is described by its hierarchy and its clips" {
  upload "$samples/tank.json"
  get "/v1/models/$id"
  holds '.format == "tweend"'
  holds '[.meshes[].name] == ["hull", "wheel", "turret", "barrel", "antenna"]'
  holds '[.meshes[].euler_characteristic] | all(. == 2)'
  holds '[.meshes[] | .boundary_edges + .nonmanifold_edges] | add == 0'
  holds '[.nodes[].name] == ["hull", "wheel_front_left", "wheel_front_right", "wheel_rear_left",
         "wheel_rear_right", "turret", "barrel", "antenna_euler", "antenna_quaternion"]'
  holds '.nodes[] | select(.name == "barrel") | .parent == "turret"'
  holds '[.clips[] | {name, duration}] ==
         [{"name": "drive", "duration": 4}, {"name": "aim", "duration": 4}]'
  holds '.warnings == []'
}

@test "STL and PLY come in by their type, as text and by their bytes alone" {
  printf 'solid wedge\nouter loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop\nouter loop vertex 1 0 0 %s\n' \
    'vertex 1 1 0 vertex 0 1 0 endloop' >wedge.stl
  printf '%s\n' ply 'format ascii 1.0' 'element vertex 4' 'property float x' 'property float y' 'property float z' \
    'element face 1' 'property list uchar int vertex_indices' end_header '0 0 0' '1 0 0' '1 1 0' '0 1 0' '4 0 1 2 3' >quad.ply
  for type in model/stl text/plain application/octet-stream; do
    post /v1/models wedge.stl --header "Content-Type: $type"
    holds '.format == "stl" and .meshes[0].vertices == 4 and .meshes[0].faces == 1 and .meshes[0].name == "wedge"'
  done
  get "$(header location)/source"
  [ "$(header content-type)" = model/stl ]
  cmp answer wedge.stl
  for type in model/ply text/plain application/octet-stream; do
    post "/v1/surface.json?level=1" quad.ply --header "Content-Type: $type"
    holds '.vertices == 9'
  done
  post /v1/models quad.ply --header "Content-Type: model/stl"
  problem 400 'declared as model/stl, but the bytes look like PLY'
  printf 'solid\nouter loop\nvertex 0 0\nendloop\n' >bad.stl
  post /v1/models bad.stl
  problem 400 '3 numbers'
  holds '.line == 4'
}

@test "BVH comes in by its type, as text and by its bytes alone" {
  printf '%s\r\n' HIERARCHY 'ROOT Hips' '{' 'OFFSET 0 1 0' 'CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation' \
    'JOINT Left Knee' '{' 'OFFSET 0 -2 0' 'CHANNELS 1 Xrotation' 'End Site' '{' 'OFFSET 0 -3 0' '}' '}' '}' \
    MOTION 'Frames: 3' 'Frame Time: 0.5' '0 1 0 0 0 90 0' '2 1 0 0 0 90 -200' >walk.bvh
  for type in model/x-bvh text/plain application/octet-stream; do
    post /v1/models walk.bvh --header "Content-Type: $type"
    holds '.format == "bvh" and ([.nodes[].name] == ["Hips", "Left Knee", "Left Knee_end"]) and .meshes == []'
    holds '.clips[0].name == "motion" and .clips[0].duration == 0.5 and .nodes[1].rest.translation == [0, -2, 0]'
    holds '.warnings | any(startswith("Frames: says 3, and there are 2")) and any(contains("180 degrees or more"))'
  done
  walk=$(header location)
  get "$walk/source"
  [ "$(header content-type)" = model/x-bvh ]
  cmp answer walk.bvh
  get "$walk/tracks"
  holds '[.tracks[] | [.node, .kind, .gimbal.order, .keys, .steps_over_180]] == [["Hips", "euler", "ZXY", 2, 0], ["Left Knee", "euler", "XYZ", 2, 1]]'
  get "$walk/pose?space=world&as=matrix&nodes=Left%20Knee_end&at=0"
  holds '.poses[0].matrix[0][12:15] | (.[0] | fabs) < 1e-6 and .[1] == -4 and (.[2] | fabs) < 1e-6'
  get "$walk/surface.glb"
  glb_json answer | gojq -e '(.nodes | length) == 3 and (has("meshes") | not) and ([.animations[0].channels[].target.path] == ["translation", "rotation", "rotation"])'
  get "$walk/pose.bvh?fps=2&order=ZXY&nodes=all"
  expect 200
  [ "$(header content-type)" = model/x-bvh ]
  grep -qx 'Frames: 2' answer
  grep -qx '2 1 0 0 0 90 0 160 0' answer
  http POST "/v1/pose.bvh?fps=2&order=ZXY&nodes=all" --data-binary @walk.bvh --header "Content-Type: model/x-bvh"
  expect 200
  grep -qx '2 1 0 0 0 90 0 160 0' answer
  post /v1/models walk.bvh --header "Content-Type: model/ply"
  problem 400 'declared as model/ply, but the bytes look like BVH'
  own "$samples/cube.obj"
  post /v1/models own.obj --header "Content-Type: model/x-bvh"
  problem 400 'declared as model/x-bvh, but the bytes look like OBJ'
  sed 's/^2 1 0/2 1O 0/' walk.bvh >bad.bvh
  post /v1/models bad.bvh
  problem 400 'is no number'
  holds '.line == 20'
  sed 's/^2 1 0/2 nan 0/' walk.bvh >bad.bvh
  post /v1/models bad.bvh
  problem 422 'not finite'
  holds '.line == 20'
  sed 's/Frames: 3/Frames: 1000000000/' walk.bvh >bad.bvh
  post /v1/models bad.bvh
  problem 422 'more than the rest of the file'
}

@test "a form with one file, as browsers send it" {
  own "$samples/cube.obj"
  http POST /v1/models --form 'file=@own.obj'
  expect 201
  [ "$(value .id)" = "$(sha256sum own.obj | head -c 32)" ]
}

@test "an upload may be packed with gzip; its address is that of the bytes inside" {
  own "$samples/cube.obj"
  gzip --keep own.obj
  post /v1/models own.obj.gz --header 'Content-Encoding: gzip'
  expect 201
  [ "$(value .id)" = "$(sha256sum own.obj | head -c 32)" ]
}

@test "a GLB that tweend made can be uploaded again" {
  post '/v1/surface.glb?level=1' "$samples/cube.obj"
  cp answer cube.glb
  http POST /v1/models --data-binary @cube.glb --header 'Content-Type: model/gltf-binary'
  [[ $status == 20[01] ]]
  holds '.format == "glb" and (.meshes | length) == 1'
  holds '.meshes[0] | .vertices == 26 and .boundary_edges == 0 and .euler_characteristic == 2'
}

@test "a glTF with its buffer inside, with hierarchy and clip, is read" {
  post '/v1/surface.gltf?level=1&clip=drive' "$samples/tank.json"
  expect 200
  cp answer tank.gltf
  http POST /v1/models --data-binary @tank.gltf --header 'Content-Type: model/gltf+json'
  [[ $status == 20[01] ]]
  holds '.format == "gltf" and (.meshes | length) == 5 and [.clips[].name] == ["drive"]'
  holds '.nodes[] | select(.name == "barrel") | .parent == "turret"'
}

@test "the source comes back byte for byte, in parts too" {
  upload "$samples/octopus.obj"
  get "/v1/models/$id/source"
  expect 200
  cmp answer "$samples/octopus.obj"
  [ "$(header accept-ranges)" = bytes ]
  etag=$(header etag)

  get "/v1/models/$id/source" --range 100-199
  expect 206
  cmp answer <(tail -c +101 "$samples/octopus.obj" | head -c 100)
  [ "$(header content-range)" = "bytes 100-199/$(stat -c %s "$samples/octopus.obj")" ]

  get "/v1/models/$id/source" --range -7
  expect 206
  cmp answer <(tail -c 7 "$samples/octopus.obj")

  get "/v1/models/$id/source" --range 0-9 --header "If-Range: $etag"
  expect 206
  get "/v1/models/$id/source" --range 0-9 --header 'If-Range: "another"'
  expect 200

  get "/v1/models/$id/source" --range 99999999-
  expect 416
  [ "$(header content-range)" = "bytes */$(stat -c %s "$samples/octopus.obj")" ]
}

@test "what has not changed is not sent again" {
  upload "$samples/cube.obj"
  for path in "/v1/models/$id" "/v1/models/$id/source" "/v1/models/$id/surface.glb?level=1"; do
    get "$path"
    expect 200
    [[ $(header cache-control) == *immutable* ]]
    etag=$(header etag)
    [[ $etag == \"*\" ]]
    get "$path" --header "If-None-Match: \"other\", $etag"
    expect 304
    [ "$(header etag)" = "$etag" ]
    [ ! -s answer ]
  done
}

@test "a deleted model is gone" {
  own "$samples/cube.obj"
  upload own.obj
  http DELETE "/v1/models/$id"
  expect 204
  [ ! -s answer ]
  for path in "/v1/models/$id" "/v1/models/$id/source" "/v1/models/$id/surface.glb" "/v1/models/$id/pose"; do
    get "$path"
    problem 404
  done
  http DELETE "/v1/models/$id"
  problem 404
  post /v1/models own.obj
  expect 201
}

@test "an id that nothing has, and one that cannot be" {
  get /v1/models/00000000000000000000000000000000
  problem 404
  for id in cube 0123 ../etc/passwd ..%2f..%2fetc%2fpasswd 0000000000000000000000000000000g; do
    get "/v1/models/$id"
    [[ $status == 40[04] ]]
    problem "$status"
  done
}

@test "the samples are there when the daemon is started with --sample" {
  needs_process
  (
    start_daemon --sample
    trap stop_daemon EXIT
    get /v1/models
    holds '[.models[].name] | sort | contains(["cube"]) and contains(["octopus"])'
    holds '[.models[].format] | sort == ["obj", "obj", "tweend"]'
  )
}

@test "a glTF and the files that it names come in one form, whatever their order" {
  printf '\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200?\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200?\0\0\0\0' >a.bin
  base64 -d >a.png <<<iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==
  cat >a.gltf <<'EOF'
{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
 "materials": [{"emissiveTexture": {"index": 0}}], "textures": [{"source": 0}], "images": [{"uri": "tex/a.png"}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
  {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "a.bin", "byteLength": 36}]}
EOF
  http POST /v1/models -F file=@a.gltf -F file=@a.bin -F file=@a.png
  expect 201
  holds '.format == "glb" and .meshes[0].faces == 1'
  id=$(gojq -r .id answer)
  http POST /v1/models -F file=@a.png -F file=@a.bin -F file=@a.gltf
  expect 200
  [ "$(gojq -r .id answer)" = "$id" ]
  get "/v1/models/$id/surface.glb?level=0"
  expect 200
  glb_json answer | gojq -e '.images[0].mimeType == "image/png" and (.images[0] | has("uri") | not)'
  http POST /v1/models -F file=@a.gltf -F file=@a.bin
  problem 422 a.png
  http POST /v1/models -F file=@a.gltf
  problem 422 "was not sent"
}

@test "a model is called as it was when it was stored first" {
  printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 %s\nf 1 2 3\n' "$RANDOM$RANDOM" >wheel.obj
  http POST /v1/models --form file=@wheel.obj
  expect 201
  holds '.name == "wheel.obj"'
  id=$(value .id)
  post "/v1/models?name=other" wheel.obj
  expect 200
  holds '.name == "wheel.obj"'
  get "/v1/models/$id"
  holds '.name == "wheel.obj"'
  get "/v1/models/$id/surface.glb?download=1"
  [[ $(header content-disposition) == 'attachment; filename="wheel.glb"; '* ]]
  get "/v1/models/$id/surface.glb"
  [[ $(header content-disposition) == 'inline; filename="wheel.glb"; '* ]]
  get "/v1/models/$id/surface.glb?download=please"
  problem 400 download
  http DELETE "/v1/models/$id"
  post "/v1/models?name=cart%20wheel" wheel.obj --header 'Content-Disposition: attachment; filename="no.obj"'
  holds '.name == "cart wheel"'
}

@test "the surface of a file that is not stored is called after it" {
  printf 'o spokes\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >wheel.obj
  http POST "/v1/surface.glb?download=1" --form "file=@wheel.obj;filename=carts/big wheel.obj"
  expect 200
  [[ $(header content-disposition) == 'attachment; filename="big wheel.glb"; '* ]]
  post /v1/surface.stl wheel.obj --header 'Content-Disposition: attachment; filename="hub.obj"'
  [[ $(header content-disposition) == 'inline; filename="hub.stl"; '* ]]
  post /v1/surface.glb wheel.obj
  [[ $(header content-disposition) == 'inline; filename="spokes.glb"; '* ]]
}
