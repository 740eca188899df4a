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

@test "OBJ: the line is counted over CRLF, comments and continued lines" {
  printf '# one\r\nv 0 0 \\\r\n0\r\nv 1 0 0\r\n\r\nv 0 1 0\r\nf 1 2 9\r\n' >bad
  refused 422 model/obj line=7
}

@test "OBJ: points alone are a model, and no surface" {
  printf 'v 0 0 0\nv 1 0 0\n' >points.obj
  upload points.obj
  get "/v1/models/$id/surface.glb"
  problem 422 'no faces'
}

@test "OBJ: nothing but noise" {
  # The same each time: one noise in some thousands has a line that begins as a statement does.
  seq 9000 | gzip -n | tail -c +100 | head -c 4000 >bad
  refused 400 model/obj line=1 'begins no statement of an OBJ file'
}

@test "OBJ: a malformed number is quoted with its line and column" {
  printf 'v 0 0 0\nv 1.0f 0 0\n' >bad
  refused 400 model/obj line=2 'line 2, column 3: "1.0f" is no number'
}

@test "OBJ: statements that the format does not have are counted in a warning" {
  printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nF 1 2 3\nf 1 2 3\nface 1 2 3\n' >odd.obj
  upload odd.obj
  holds '.warnings == ["2 statements are left out, the first in line 4: \"F\" is none that is known"]'
  upload "$samples/cube.obj"
  holds '.warnings == []'
}

# foreign PATTERN [CURL ARGUMENT...]: what curl sends is 415, says what it looks like, and lists what is read.
foreign() {
  http POST /v1/models "${@:2}"
  problem 415 "$1"
  holds '.supported | contains(["model/obj", "model/gltf-binary"])'
}

@test "curl -d drops line ends: an OBJ is refused with advice, JSON is read" {
  foreign 'an OBJ without its line ends: curl -d drops them' -d "@$samples/cube.obj"
  http POST /v1/models -d "@$samples/tank.json"
  [[ $status == 201 || $status == 200 ]]
}

@test "files of other formats are 415, in a form too" {
  gzip --stdout "$samples/cube.obj" >cube.obj.gz
  foreign 'gzip: send it with Content-Encoding: gzip' --data-binary @cube.obj.gz
  http POST /v1/models --data-binary @cube.obj.gz --header 'Content-Encoding: gzip'
  [[ $status == 201 || $status == 200 ]]
  printf 'Kaydara FBX Binary  \0' >model.fbx
  foreign 'FBX' --form file=@model.fbx
  printf '\x89PNG\r\n' >picture.png
  foreign 'Content-Type is none of' --data-binary @picture.png --header 'Content-Type: image/png'
  foreign 'looks like PNG' --data-binary @picture.png --header 'Content-Type: application/octet-stream'
  http POST /v1/models --data-binary @picture.png --header 'Content-Type: model/obj'
  problem 400 'declared as model/obj, but the bytes look like PNG'
}

@test "names and paths that nearly exist name those that do" {
  upload "$samples/tank.json"
  get "/v1/models/$id/pose.json?clip=drvie"
  problem 404 'did you mean drive\?'
  get "/v1/models/$id/surface.glb?scheme=catmul-clark"
  problem 400 'did you mean catmull-clark\?'
  get "/v1/models/$id/poses"
  problem 404 'did you mean /v1/models/\{id\}/pose'
  get /v1/frobnicate
  problem 404
  [[ $(value .detail) != *'did you mean'* ]]
}

@test "JSON: an index out of range" {
  printf '{"meshes":[{"positions":[[0,0,0],[1,0,0],[0,1,0]],"faces":[[0,1,3]]}]}' >bad
  refused 422 application/json pointer=/meshes/0/faces/0/2
}

@test "JSON: nested ten thousand deep inside a model" {
  printf '{"meshes": %s%s}' "$(printf '[%.0s' $(seq 10000))" "$(printf ']%.0s' $(seq 10000))" >bad
  refused 400 application/json 'dep|nest'
}

# gltf_of URI: one triangle, whose 36 bytes of points, 6 of indices and 2 of padding lie there.
gltf_of() {
  printf '{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
"buffers":[{"byteLength":44%s}]}' "${1:+,\"uri\":\"$1\"}"
}
triangle=AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=

@test "glTF: files and hosts beside the upload are never asked" {
  gltf_of "data:application/octet-stream;base64,$triangle" >good
  http POST /v1/models --data-binary @good --header 'Content-Type: model/gltf+json'
  [[ $status == 20[01] ]]
  base64 --decode <<<"$triangle" >secret.bin
  gltf_of "$PWD/secret.bin" >bad
  refused 422 model/gltf+json /buffers/0 'uri|outside|external'
  gltf_of http://127.0.0.1:1/x >bad
  refused 422 model/gltf+json /buffers/0
}

@test "glTF: a data URI of other bytes than its buffer, or of another type, is told as that" {
  gltf_of 'data:application/octet-stream;base64,AAAA' >bad
  refused 422 model/gltf+json pointer=/buffers/0/byteLength 'the data URI holds 3 bytes, not 44'
  gltf_of "data:text/plain,$triangle" >bad
  refused 422 model/gltf+json pointer=/buffers/0/uri 'base64'
}

@test "glTF: a million empty objects" {
  { printf '{"asset":{"version":"2.0"},"materials":[{}'; head -c 3000000 /dev/zero | sed 's/\x0\x0\x0/,{}/g'; printf ']}'; } >bad
  refused '400|413|422' model/gltf+json '[a-z]'
}

@test "GLB: cut off, or with a chunk longer than the file" {
  base64 --decode <<<"$triangle" >chunk.bin
  glb "$(gltf_of)" chunk.bin >good
  http POST /v1/models --data-binary @good --header 'Content-Type: model/gltf-binary'
  [[ $status == 20[01] ]]
  head -c 400 good >bad
  refused '400|422' model/gltf-binary '[a-z]'
  BIN_LENGTH=100000 glb "$(gltf_of)" chunk.bin >bad
  refused 400 model/gltf-binary 'chunk|length'
}

@test "an empty body" {
  : >bad
  refused 400 application/octet-stream 'empty|body|bytes'
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

@test "a form that does not end" {
  printf -- '--x\r\nContent-Disposition: form-data; name="f"; filename="f"\r\n\r\nv 0 0 0' >bad
  http POST /v1/models --data-binary @bad --header 'Content-Type: multipart/form-data; boundary=x'
  problem 400
}
