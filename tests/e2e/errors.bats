# Bad uploads of every format: refused with a place, nothing stored, the daemon lives on.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# refused STATUSES TYPE PLACE [WORDS]: posts the file bad, which must be refused with one of the
# statuses (400|422) at a place: line=N, pointer=/a/b, or what the detail says; WORDS match the detail
# or that of one error. Nothing is stored, and the daemon answers the next request.
refused() {
  local statuses=$1 type=$2 place=$3 words=${4-}
  http POST /v1/models --data-binary @bad --header "Content-Type: $type"
  [[ $status =~ ^($statuses)$ ]] || { echo "expected $statuses"; show; return 1; }
  problem "$status"
  case $place in
  line=*) holds ".line == ${place#line=}" ;;
  pointer=*) holds "[.errors[].pointer] | any(. == \"${place#pointer=}\")" ;;
  *) [[ $(value '[.detail, .errors[]?.detail] | join(" ")') =~ $place ]] || { show; return 1; } ;;
  esac
  [[ -z $words ]] || [[ $(value '[.detail, .errors[]?.detail] | join(" ")') =~ $words ]] || { show; return 1; }
  local id
  id=$(sha256sum bad | head -c 32)
  get "/v1/models/$id"
  expect 404
  get /healthz
  expect 200
}

obj() { printf '%b' "$1" >bad && refused "$2" model/obj "$3" "${4-}"; }
json() { printf '%s' "$1" >bad && refused "$2" application/json "$3" "${4-}"; }
gltf() { printf '%s' "$1" >bad && refused "$2" model/gltf+json "$3" "${4-}"; }
bin() { refused "$1" model/gltf-binary "$2" "${3-}"; }

# ---- OBJ -----------------------------------------------------------------------------------------

triangle='v 0 0 0\nv 1 0 0\nv 0 1 0\n'

@test "OBJ: a face names a point that is not there" {
  obj "${triangle}f 1 2 4\n" 422 line=4 4
}

@test "OBJ: a face counts back before the first point" {
  obj "${triangle}f -1 -2 -4\n" 422 line=4
}

@test "OBJ: index 0" {
  obj "${triangle}f 0 1 2\n" '400|422' line=4
}

@test "OBJ: an index over 32 bits" {
  obj "${triangle}f 1 2 4294967299\n" '400|422' line=4
}

@test "OBJ: an index over 64 bits" {
  obj "${triangle}f 1 2 99999999999999999999999\n" '400|422' line=4
}

@test "OBJ: a coordinate is NaN" {
  obj 'v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n' '400|422' line=2
}

@test "OBJ: a coordinate is infinite" {
  obj 'v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n' '400|422' line=3
}

@test "OBJ: a coordinate over single precision" {
  obj 'v 0 0 0\nv 1e99 0 0\nv 0 1 0\nf 1 2 3\n' '400|422' line=2
}

@test "OBJ: a point of two coordinates" {
  obj 'v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n' 400 line=2
}

@test "OBJ: a coordinate is a word" {
  obj 'v 0 0 zero\n' 400 line=1
}

@test "OBJ: a face of two corners" {
  obj "${triangle}f 1 2\n" '400|422' line=4
}

@test "OBJ: a face that touches itself" {
  obj "${triangle}v 1 1 0\nf 1 2 1 3\n" 422 line=5
}

@test "OBJ: a face with half an index" {
  obj "${triangle}f 1/ 2 x\n" 400 line=4
}

@test "OBJ: a corner names a texture coordinate that is not there" {
  obj "${triangle}vt 0 0\nf 1/1 2/2 3/1\n" 422 line=5
}

@test "OBJ: cut off in the middle of a face" {
  obj "${triangle}f 1 2" '400|422' line=4
}

@test "OBJ: the line is counted over CRLF, comments and continued lines" {
  obj '# one\r\nv 0 0 \\\r\n0\r\nv 1 0 0\r\n\r\nv 0 1 0\r\nf 1 2 9\r\n' 422 line=7
}
@test "OBJ: zero bytes inside" {
  obj 'v 0 0 0\n\0\0\0\0\n' '400|422' line=2
}

@test "OBJ: points alone are a model, and no surface" {
  printf 'v 0 0 0\nv 1 0 0\n' >points.obj
  upload points.obj
  get "/v1/models/$id/surface.glb"
  problem 422 'no faces'
}

@test "OBJ: no point at all" {
  obj '# nothing\n' '400|422' '[a-z]'
}

@test "OBJ: nothing but noise" {
  head -c 4000 /dev/urandom >bad
  refused '400|422' model/obj '[a-z]'
}

# ---- tweend JSON ---------------------------------------------------------------------------------

# mesh MEMBERS: a document with one triangle, the members coming last.
mesh() { printf '{"meshes":[{"positions":[[0,0,0],[1,0,0],[0,1,0]],"faces":[[0,1,2]]%s}]}' "$1"; }
# clip TRACK: a document of two nodes and one track.
clip() { printf '{"nodes":[{"name":"a"},{"name":"b","parent":"a"}],"clips":[{"name":"c","tracks":[%s]}]}' "$1"; }
keys='"quaternions":[[0,0,0,1],[0,0,1,0]]'

@test "JSON: cut off" {
  json '{"meshes": [{"positions": [[0, 0, 0], [1, 0' 400 '[a-z]'
}

@test "JSON: text after the end" {
  json '{"nodes": []} {"nodes": []}' 400 '[a-z]'
}

@test "JSON: an array where an object is needed" {
  json '[1, 2, 3]' '400|422' '[a-z]'
}

@test "JSON: an unknown member, by its name" {
  json '{"mesches": []}' '400|422' mesches
}

@test "JSON: a member twice" {
  json '{"nodes": [], "nodes": []}' '400|422' nodes
}

@test "JSON: nested ten thousand deep" {
  json "$(printf '[%.0s' $(seq 10000))" 400 'dep|nest'
}

@test "JSON: nested ten thousand deep inside a model" {
  json "{\"meshes\": $(printf '[%.0s' $(seq 10000))$(printf ']%.0s' $(seq 10000))}" 400 'dep|nest'
}
@test "JSON: a number that is none" {
  json "$(mesh '' | sed 's/1,0,0/NaN,0,0/')" 400 '[a-z]'
}

@test "JSON: a number over double precision" {
  json "$(mesh '' | sed 's/1,0,0/1e999,0,0/')" '400|422' '[a-z]'
}

@test "JSON: a number over single precision" {
  json "$(mesh '' | sed 's/1,0,0/1e60,0,0/')" 422 pointer=/meshes/0/positions/1/0
}

@test "JSON: broken UTF-8" {
  json "$(printf '{"nodes":[{"name":"\xff\xfe"}]}')" '400|422' 'UTF'
}

@test "JSON: an index out of range" {
  json '{"meshes":[{"positions":[[0,0,0],[1,0,0],[0,1,0]],"faces":[[0,1,3]]}]}' 422 pointer=/meshes/0/faces/0/2
}

@test "JSON: a negative index" {
  json '{"meshes":[{"positions":[[0,0,0],[1,0,0],[0,1,0]],"faces":[[0,1,-1]]}]}' '400|422' pointer=/meshes/0/faces/0/2
}

@test "JSON: half an index" {
  json '{"meshes":[{"positions":[[0,0,0],[1,0,0],[0,1,0]],"faces":[[0,1,1.5]]}]}' '400|422' pointer=/meshes/0/faces/0/2
}

@test "JSON: a corner twice" {
  json '{"meshes":[{"positions":[[0,0,0],[1,0,0],[0,1,0]],"faces":[[0,1,1]]}]}' 422 pointer=/meshes/0/faces/0/2
}

@test "JSON: a point of two numbers" {
  json '{"meshes":[{"positions":[[0,0],[1,0,0],[0,1,0]],"faces":[[0,1,2]]}]}' '400|422' /meshes/0/positions/0
}

@test "JSON: a crease of something that is no edge" {
  json "$(mesh ',"creases":[{"edge":[0,7],"sharpness":1}]')" 422 /meshes/0/creases/0
}

@test "JSON: texture coordinates that do not fit the faces" {
  json "$(mesh ',"uvs":[[0,0]],"face_uvs":[[0,0]]')" '400|422' /meshes/0/face_uvs
}

@test "JSON: a node is its own ancestor" {
  json '{"nodes":[{"name":"a","parent":"c"},{"name":"b","parent":"a"},{"name":"c","parent":"b"}]}' 422 'cycle|ancestor'
}

@test "JSON: a parent that is not there" {
  json '{"nodes":[{"name":"a","parent":"b"}]}' 422 pointer=/nodes/0/parent
}

@test "JSON: a mesh that is not there" {
  json '{"nodes":[{"name":"a","mesh":"b"}]}' 422 pointer=/nodes/0/mesh
}

@test "JSON: two nodes of one name cannot be told apart as parents" {
  json '{"nodes":[{"name":"a"},{"name":"a"},{"name":"b","parent":"a"}]}' '400|422' /nodes
}
@test "JSON: a track of a node that is not there" {
  json "$(clip '{"node":"z","path":"rotation","times":[0,1],'"$keys"'}')" 422 pointer=/clips/0/tracks/0/node
}

@test "JSON: key times that fall" {
  json "$(clip '{"node":"a","path":"rotation","times":[1,0],'"$keys"'}')" 422 pointer=/clips/0/tracks/0/times/1
}

@test "JSON: equal key times" {
  json "$(clip '{"node":"a","path":"rotation","times":[1,1],'"$keys"'}')" 422 pointer=/clips/0/tracks/0/times/1
}

@test "JSON: a negative key time" {
  json "$(clip '{"node":"a","path":"rotation","times":[-1,1],'"$keys"'}')" 422 pointer=/clips/0/tracks/0/times/0
}

@test "JSON: fewer keys than times" {
  json "$(clip '{"node":"a","path":"rotation","times":[0,1,2],'"$keys"'}')" '400|422' /clips/0/tracks/0
}

@test "JSON: a quaternion of zero length" {
  json "$(clip '{"node":"a","path":"rotation","times":[0],"quaternions":[[0,0,0,0]]}')" 422 /clips/0/tracks/0/quaternions/0
}

@test "JSON: an axis of zero length" {
  json "$(clip '{"node":"a","path":"rotation","times":[0],"axis_angles":[[0,0,0,1]]}')" 422 /clips/0/tracks/0/axis_angles/0
}

@test "JSON: an order that is none" {
  json "$(clip '{"node":"a","path":"rotation","interpolation":"euler","order":"XYX","times":[0],"eulers":[[0,0,0]]}')" '400|422' pointer=/clips/0/tracks/0/order
}

@test "JSON: two tracks on one node and path" {
  json "$(clip '{"node":"a","path":"rotation","times":[0,1],'"$keys"'},{"node":"a","path":"rotation","times":[0,1],'"$keys"'}')" 422 /clips/0/tracks/1
}

# ---- glTF ----------------------------------------------------------------------------------------

# One triangle: 36 bytes of points, 6 of indices, 2 of padding.
triangle_buffer=AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=
document='{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
"buffers":[{"byteLength":44,"uri":"data:application/octet-stream;base64,'$triangle_buffer'"}]}'

# but FROM TO: the document with one thing changed.
but() {
  [[ $document == *"$1"* ]] || return
  printf '%s' "${document/"$1"/$2}"
}

@test "glTF: the document that the others spoil is good" {
  printf '%s' "$document" >good
  http POST /v1/models --data-binary @good --header 'Content-Type: model/gltf+json'
  [[ $status == 20[01] ]]
  holds '.meshes[0] | .vertices == 3 and .faces == 1'
}
@test "glTF: cut off" {
  gltf "${document:0:300}" 400 '[a-z]'
}

@test "glTF: an asset without a version" {
  gltf "$(but '"asset":{"version":"2.0"},' '"asset":{},')" '400|422' 'asset|version'
}

@test "glTF: a version that is not 2" {
  gltf "$(but '"version":"2.0"' '"version":"1.0"')" '400|422' version
}

@test "glTF: a file beside the upload is never opened" {
  echo secret >secret.bin
  gltf "$(but "data:application/octet-stream;base64,$triangle_buffer" "$PWD/secret.bin")" 422 /buffers/0 'uri|outside|external'
}
@test "glTF: nor a host asked" {
  gltf "$(but "data:application/octet-stream;base64,$triangle_buffer" "http://127.0.0.1:1/x")" 422 /buffers/0
}

@test "glTF: a buffer shorter than it says" {
  gltf "$(but '"byteLength":44' '"byteLength":4400')" '400|422' buffer
}

@test "glTF: a view past its buffer" {
  gltf "$(but '"byteOffset":36,"byteLength":6' '"byteOffset":36,"byteLength":600')" 422 /bufferViews/1
}

@test "glTF: a view whose end overflows" {
  gltf "$(but '"byteOffset":36,"byteLength":6' '"byteOffset":18446744073709551600,"byteLength":40')" '400|422' '[a-z]'
}

@test "glTF: an accessor past its view" {
  gltf "$(but '"count":3,"type":"VEC3"' '"count":300,"type":"VEC3"')" 422 /accessors/0
}

@test "glTF: an accessor of four billion" {
  gltf "$(but '"count":3,"type":"VEC3"' '"count":4294967295,"type":"VEC3"')" 422 /accessors/0
}

@test "glTF: an accessor of a view that is not there" {
  gltf "$(but '"bufferView":1,' '"bufferView":9,')" 422 'accessors?.1'
}

@test "glTF: a primitive with an accessor that is not there" {
  gltf "$(but '"POSITION":0' '"POSITION":7')" 422 /meshes/0
}

@test "glTF: an index out of range" {
  gltf "$(but "$triangle_buffer" "${triangle_buffer/AAABAAIAAAA=/AAABAAkAAAA=}")" 422 '/accessors/1|/meshes/0'
}
@test "glTF: a point that is NaN" {
  gltf "$(but "$triangle_buffer" "AADAfwAA${triangle_buffer:8}")" 422 '/accessors/0|/meshes/0'
}
@test "glTF: a node among its own descendants" {
  gltf "$(but '"nodes":[{"mesh":0}]' '"nodes":[{"mesh":0,"children":[1]},{"children":[0]}]')" 422 /nodes
}

@test "glTF: a node with two parents" {
  gltf "$(but '"nodes":[{"mesh":0}]' '"nodes":[{"mesh":0,"children":[2]},{"children":[2]},{}]')" 422 /nodes
}

@test "glTF: a child that is not there" {
  gltf "$(but '"nodes":[{"mesh":0}]' '"nodes":[{"mesh":0,"children":[5]}]')" 422 /nodes/0
}

@test "glTF: an extension that it needs and tweend does not know" {
  gltf "$(but '"scene":0' '"scene":0,"extensionsUsed":["EXT_moon"],"extensionsRequired":["EXT_moon"]')" 422 EXT_moon
}
@test "glTF: nested ten thousand deep" {
  gltf "$(but '"scene":0' "\"scene\":0,\"extras\":$(printf '[%.0s' $(seq 10000))$(printf ']%.0s' $(seq 10000))")" '400|422' 'dep|nest'
}
@test "glTF: a million empty objects" {
  { printf '{"asset":{"version":"2.0"},"materials":[{}'; head -c 3000000 /dev/zero | sed 's/\x0\x0\x0/,{}/g'; printf ']}'; } >bad
  refused '400|413|422' model/gltf+json '[a-z]'
}

# ---- GLB -----------------------------------------------------------------------------------------

json_of_glb=${document/',"uri":"data:application/octet-stream;base64,'$triangle_buffer'"'/}
chunk() { base64 --decode <<<"$triangle_buffer" >chunk.bin; }

@test "GLB: the file that the others spoil is good" {
  chunk
  glb "$json_of_glb" chunk.bin >good
  http POST /v1/models --data-binary @good --header 'Content-Type: model/gltf-binary'
  [[ $status == 20[01] ]]
  holds '.format == "glb" and .meshes[0].vertices == 3'
}
@test "GLB: cut off at every fourth byte" {
  chunk
  glb "$json_of_glb" chunk.bin >whole
  for ((size = 0; size < $(stat -c %s whole); size += 4)); do
    head -c "$size" whole >bad
    http POST /v1/models --data-binary @bad --header 'Content-Type: model/gltf-binary'
    [[ $status == 400 || $status == 422 ]] || { echo "after $size bytes"; show; return 1; }
  done
  problem "$status"
}
@test "GLB: nothing but the magic" {
  printf glTF >bad && bin 400 'byte|header|length|short'
}

@test "GLB: another version" {
  chunk; glb "$json_of_glb" chunk.bin | sed '1s/^glTF\x02/glTF\x01/' >bad; bin '400|422' version
}

@test "GLB: longer than it says" {
  chunk; GLB_LENGTH=100 glb "$json_of_glb" chunk.bin >bad; bin 400 bytes
}

@test "GLB: shorter than it says" {
  chunk; GLB_LENGTH=1000000 glb "$json_of_glb" chunk.bin >bad; bin 400 bytes
}

@test "GLB: a JSON chunk longer than the file" {
  chunk; JSON_LENGTH=100000000 glb "$json_of_glb" chunk.bin >bad; bin 400 'chunk|length'
}

@test "GLB: a JSON chunk whose end overflows" {
  chunk; JSON_LENGTH=4294967292 glb "$json_of_glb" chunk.bin >bad; bin 400 'chunk|length'
}

@test "GLB: a JSON chunk of no length" {
  chunk; JSON_LENGTH=0 glb "$json_of_glb" chunk.bin >bad; bin 400 '[a-z]'
}

@test "GLB: a BIN chunk longer than the file" {
  chunk; BIN_LENGTH=100000 glb "$json_of_glb" chunk.bin >bad; bin 400 'chunk|length'
}

@test "GLB: a BIN chunk shorter than the buffer says" {
  head -c 8 /dev/zero >chunk.bin; glb "$json_of_glb" chunk.bin >bad; bin '400|422' 'buffer|BIN|length'
}

@test "GLB: a buffer without a BIN chunk" {
  glb "$json_of_glb" >bad; bin '400|422' 'buffer|BIN'
}

@test "GLB: the BIN chunk first" {
  chunk
  { printf glTF; u32 2; u32 64; u32 44; printf 'BIN\0'; cat chunk.bin; } >bad
  bin 400 'chunk|JSON'
}
@test "GLB: two buffers of one chunk" {
  chunk
  glb "${json_of_glb/'"buffers":[{"byteLength":44}]'/'"buffers":[{"byteLength":44},{"byteLength":44}]'}" chunk.bin >bad
  bin '400|422' /buffers/1
}
@test "GLB: no glTF inside" {
  glb '[]' >bad; bin '400|422' '[a-z]'
}

# ---- containers ----------------------------------------------------------------------------------

@test "an empty body" {
  : >bad
  refused 400 application/octet-stream 'empty|body|bytes'
}
@test "bytes of no format" {
  head -c 500 /dev/zero >bad
  http POST /v1/models --data-binary @bad --header 'Content-Type: application/octet-stream'
  [[ $status == 400 || $status == 415 ]]
  problem "$status"
}
@test "a type that no model has" {
  http POST /v1/models --data-binary "@$samples/cube.obj" --header 'Content-Type: image/png'
  problem 415
  [[ $(value .detail) == *model/obj* ]]
}
@test "a document of another type than it says" {
  { cat "$samples/tank.json"; echo ' '; } >bad
  refused '400|415|422' model/gltf-binary '[a-z]'
}
@test "a gzip stream that breaks off" {
  gzip <"$samples/octopus.obj" | head -c 1000 >bad
  http POST /v1/models --data-binary @bad --header 'Content-Encoding: gzip'
  problem 400 gzip
}
@test "bytes that are not gzip" {
  cp "$samples/cube.obj" bad
  http POST /v1/models --data-binary @bad --header 'Content-Encoding: gzip'
  problem 400 gzip
}
@test "an encoding that tweend does not know" {
  http POST /v1/models --data-binary "@$samples/cube.obj" --header 'Content-Encoding: br'
  problem 415
}
@test "a form without a file" {
  http POST /v1/models --form 'name=cube'
  [[ $status == 400 || $status == 422 ]]
  problem "$status"
}
@test "a form that does not end" {
  printf -- '--x\r\nContent-Disposition: form-data; name="f"; filename="f"\r\n\r\nv 0 0 0' >bad
  http POST /v1/models --data-binary @bad --header 'Content-Type: multipart/form-data; boundary=x'
  problem 400
}
