# What somebody models onto a level of a surface: sent as moved points, kept by all levels.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# upload_shape JSON: a mesh of this shape.
upload_shape() {
  echo '{"meshes": [{"name": "hull", "shape": '"$1"'}]}' >shape.json
  upload shape.json
}

# as_cage: the cage of the model $id as it is stored once it has been remade, so that only details differ.
as_cage() {
  http POST "/v1/models/$id/edits" --header 'Content-Type: application/json' --data '{"edits": []}'
  id=$(value .id)
}

# dent FILE: the OBJ with every third point moved, each elsewhere.
dent() { awk '/^v / && ++n % 3 == 0 { $2 += 0.01 * (n % 5); $3 -= 0.02; $4 += 0.003 * (n % 7) } 1' "$1"; }

# sculpt ID LEVEL FILE [CURL ARGUMENT...]: posts an OBJ, sets $id.
sculpt() {
  post "/v1/models/$1/detail?level=$2" "$3" "${@:4}"
  [[ $status == 201 || $status == 200 ]] || { show; return 1; }
  id=$(value .id)
}

# near FILE FILE [TOLERANCE]: the points of two OBJs are the same, line by line.
near() {
  awk -v most="${3:-1e-6}" '
    function fail(why) { print why; failed = 1; exit 1 }
    !/^v / { next }
    NR == FNR { first[++count] = $0; next }
    {
      if (split(first[++n], point) != NF) fail(n ": " first[n] " and " $0)
      for (i = 2; i <= 4; i++) { d = $i - point[i]; if (d > most || d < -most) fail(n ": " first[n] " and " $0) }
    }
    END { if (!failed && (count == 0 || n != count)) fail(count " points and " n) }' "$1" "$2"
}

differ() { if cmp --quiet "$1" "$2"; then return 1; fi; }

# count_models: how many are stored.
count_models() {
  get '/v1/models?limit=1000'
  value '.models | length'
}

# ---- what is shown -------------------------------------------------------------------------------

@test "without details a sculpted model has the bytes of the plain one" {
  upload "$samples/octopus.obj"
  as_cage
  plain=$id
  get "/v1/models/$plain/surface.obj?level=2"
  dent answer >dented.obj
  sculpt "$plain" 2 dented.obj
  [ "$id" != "$plain" ]
  for form in "0 glb" "1 glb" "2 glb" "3 glb" "4 glb" "1 obj" "3 obj" "0 gltf" "2 gltf" "1 json" "4 json"; do
    read -r level extension <<<"$form"
    query="$extension?level=$level"
    [[ $extension != obj ]] || query+="&limit=true"
    get "/v1/models/$plain/surface.$query"
    expect 200
    mv answer plain.answer
    get "/v1/models/$id/surface.$query&details=false"
    expect 200
    cmp answer plain.answer
    get "/v1/models/$plain/surface.$query&details=false"
    cmp answer plain.answer
    get "/v1/models/$id/surface.$query&details=true"
    mv answer shown.answer
    get "/v1/models/$id/surface.$query"
    cmp answer shown.answer
    [[ $extension == json ]] || differ answer plain.answer
  done
}

@test "a level shows the points that were sent, in their order, and sent again they are the same model" {
  for shape in '{"kind": "icosphere", "level": 1}' '{"kind": "quad_sphere", "segments": 3}' '{"kind": "torus", "segments": 8, "sides": 5}' \
    '{"kind": "grid", "segments": [4, 3]}' '{"kind": "cylinder", "segments": 5}'; do
    upload_shape "$shape"
    plain=$id
    levels="1 3"
    [[ $shape != *icosphere* ]] || levels="0 1 2 3 4"
    for level in $levels; do
      get "/v1/models/$plain/surface.obj?level=$level"
      mv answer plain.obj
      dent plain.obj >dented.obj
      sculpt "$plain" "$level" dented.obj
      holds ".meshes[0].details == $( ((level > 0)) && echo "[$level]" || echo "[]")"
      sculpted=$id
      get "/v1/models/$sculpted/surface.obj?level=$level"
      expect 200
      mv answer shown.obj
      near dented.obj shown.obj
      sculpt "$sculpted" "$level" shown.obj -H 'If-None-Match: *'
      expect 200
      [ "$id" = "$sculpted" ]
      grep -qix "location: /v1/models/$id" <(tr -d '\r' <headers)
    done
  done
}

@test "the order of points is that of surface.obj whatever it is asked with" {
  upload "$samples/octopus.obj"
  for level in 1 2 3; do
    get "/v1/models/$id/surface.obj?level=$level"
    mv answer plain.obj
    for query in normals=none limit=true; do
      get "/v1/models/$id/surface.obj?level=$level&$query"
      cmp <(sed -n 's/^f //p' plain.obj | tr ' ' '\n' | cut -d / -f 1) \
        <(sed -n 's/^f //p' answer | tr ' ' '\n' | cut -d / -f 1)
    done
  done
}

@test "points as they are change nothing" {
  # -0 is printed as 0.
  echo '{"meshes": [{"positions": [[-0.0, 0, 0], [1, -0.0, 0], [1, 0, -1], [0, 0.5, -1]], "faces": [[0, 1, 2, 3]]}]}' >zero.json
  upload zero.json
  as_cage
  get "/v1/models/$id/surface.obj?level=0"
  mv answer same.obj
  plain=$id
  sculpt "$plain" 0 same.obj
  [ "$id" = "$plain" ]
  upload "$samples/octopus.obj"
  as_cage
  for level in 0 1 3; do
    get "/v1/models/$id/surface.obj?level=$level"
    mv answer same.obj
    plain=$id
    sculpt "$plain" "$level" same.obj
    expect 200
    [ "$id" = "$plain" ]
  done
}

@test "details of several levels add up, and coarser levels can be moved below finer details" {
  upload_shape '{"kind": "quad_sphere", "segments": 3}'
  for level in 1 3 2; do
    get "/v1/models/$id/surface.obj?level=$level"
    dent answer >dented.obj
    sculpt "$id" "$level" dented.obj
    get "/v1/models/$id/surface.obj?level=$level"
    near dented.obj answer
  done
  get "/v1/models/$id"
  holds '.meshes[0].details == [1, 2, 3]'
  # What a level gets beside is there on all others.
  get "/v1/models/$id/surface.obj?level=3"
  mv answer fine.obj
  get "/v1/models/$id/surface.obj?level=1"
  awk '/^v / { $3 += 2 } 1' answer >shifted.obj
  sculpt "$id" 1 shifted.obj
  get "/v1/models/$id/surface.obj?level=3"
  awk '/^v / { $3 += 2 } 1' fine.obj >fine_shifted.obj
  near fine_shifted.obj answer 1e-5
}

@test "lower levels show the points of the deepest one" {
  upload_shape '{"kind": "grid", "segments": [4, 4]}'
  get "/v1/models/$id/surface.obj?level=2"
  awk '/^v / { $3 += 0.5 } 1' answer >up.obj
  sculpt "$id" 2 up.obj
  for level in 0 1 2 3; do
    get "/v1/models/$id/surface.obj?level=$level"
    awk '/^v / && ($3 < 0.499 || $3 > 0.501) { print; exit 1 }' answer
  done
}

# ---- what becomes of it --------------------------------------------------------------------------

@test "details turn and grow with the cage" {
  upload_shape '{"kind": "quad_sphere", "segments": 3}'
  get "/v1/models/$id/surface.obj?level=2"
  dent answer >dented.obj
  sculpt "$id" 2 dented.obj
  sculpted=$id
  http POST "/v1/models/$sculpted/edits" --header 'Content-Type: application/json' --data '{"edits": [
    {"edit": "rotate", "faces": "all", "axis": [0, 1, 0], "degrees": 90, "about": [0, 0, 0]},
    {"edit": "scale", "faces": "all", "by": 2, "about": [0, 0, 0]},
    {"edit": "move", "faces": "all", "by": [0, 3, 0]}]}'
  expect 201
  holds '.meshes[0].details == [2] and .warnings == []'
  turned=$(value .id)
  for level in 0 1 2 3 4; do
    get "/v1/models/$sculpted/surface.obj?level=$level"
    awk '/^v / { print "v", 2 * $4, 2 * $3 + 3, -2 * $2 }' answer >expected.obj
    get "/v1/models/$turned/surface.obj?level=$level"
    near expected.obj answer 2e-5
  done
}

@test "edits that keep the faces keep the details, others say that they go" {
  upload_shape '{"kind": "quad_sphere", "segments": 2}'
  get "/v1/models/$id/surface.obj?level=2"
  dent answer >dented.obj
  sculpt "$id" 2 dented.obj
  for edit in '"crease", "edges": "all"' '"corner", "vertices": [0]' '"hole", "faces": [0]' \
    '"smooth", "iterations": 2' '"move", "vertices": [0], "by": [0, 1, 0]'; do
    http POST "/v1/models/$id/edits" --header 'Content-Type: application/json' --data '{"edits": [{"edit": '"$edit"'}]}'
    expect 201
    holds '.meshes[0].details == [2]'
    [ -z "$(header x-tweend-warning)" ]
    get "/v1/models/$(value .id)/surface.glb?level=3"
    expect 200
  done
  for edit in '"extrude", "faces": [0], "distance": 1' '"delete", "faces": [0]' '"flip"' '"triangulate"' \
    '"loop_cut", "edge": [0, 1]' '"merge", "vertices": [0, 1]'; do
    http POST "/v1/models/$id/edits" --header 'Content-Type: application/json' --data '{"edits": [{"edit": '"$edit"'}]}'
    expect 201
    holds '.meshes[0].details == []'
    [[ $(header x-tweend-warning) == *left%20out* ]]
  done
}

@test "the cage as GLB or glTF keeps the surfaces of all levels to the byte" {
  upload "$samples/octopus.obj"
  for level in 1 3; do
    get "/v1/models/$id/surface.obj?level=$level"
    dent answer >dented.obj
    sculpt "$id" "$level" dented.obj
  done
  sculpted=$id
  for extension in glb gltf; do
    get "/v1/models/$sculpted/surface.$extension?level=0&polygons=ngon"
    expect 200
    mv answer "kept.$extension"
    upload "kept.$extension"
    holds '.meshes[0].details == [1, 3] and .warnings == []'
    for level in 0 1 2 3 4; do
      get "/v1/models/$sculpted/surface.obj?level=$level"
      mv answer expected
      get "/v1/models/$id/surface.obj?level=$level"
      cmp answer expected
    done
    get "/v1/models/$sculpted/surface.glb?level=2"
    mv answer expected
    get "/v1/models/$id/surface.glb?level=2"
    cmp answer expected
  done
  get "/v1/models/$sculpted/surface.glb?level=0&polygons=ngon&details=false"
  mv answer plain.glb
  upload plain.glb
  holds '.meshes[0].details == []'
}

@test "a mesh comes back from its level with all that its cage cannot say" {
  upload_shape '{"kind": "torus", "segments": 6, "sides": 4}'
  get "/v1/models/$id/surface.obj?level=2"
  dent answer >dented.obj
  upload dented.obj
  http POST "/v1/models/$id/coarsen"
  expect 201
  holds '.levels >= 1 and .meshes[0].details == [.levels]'
  levels=$(value .levels)
  get "/v1/models/$(value .id)/surface.obj?level=$levels"
  # Faces and points may come in another order.
  diff <(grep '^v ' dented.obj | awk '{ printf "%.4f %.4f %.4f\n", $2, $3, $4 }' | sed 's/-0\.0000/0.0000/g' | sort) \
    <(grep '^v ' answer | awk '{ printf "%.4f %.4f %.4f\n", $2, $3, $4 }' | sed 's/-0\.0000/0.0000/g' | sort)
}

@test "normals of a file are those of its cage, not of moved points" {
  upload_shape '{"kind": "cylinder", "segments": 5}'
  get "/v1/models/$id/surface.glb?level=1"
  mv answer normals.glb
  upload normals.glb
  plain=$id
  get "/v1/models/$plain/surface.obj?level=0"
  mv answer plain.obj
  awk '/^v / { print "v", $2 * (1 + $3), $3, $4 * (1 + $3); next } 1' plain.obj >wide.obj
  sculpt "$plain" 0 wide.obj
  get "/v1/models/$id/surface.obj?level=0"
  near wide.obj answer
  differ <(grep '^vn ' plain.obj) <(grep '^vn ' answer)
  get "/v1/models/$plain/surface.obj?level=1"
  dent answer >dented.obj
  sculpt "$plain" 1 dented.obj
  get "/v1/models/$id/surface.obj?level=0"
  differ <(grep '^vn ' plain.obj) <(grep '^vn ' answer)
  get "/v1/models/$id/surface.obj?level=0&details=false"
  cmp answer plain.obj
}

# ---- bodies --------------------------------------------------------------------------------------

@test "points come as OBJ, as JSON, in a form, compressed: it is one model" {
  upload_shape '{"kind": "cylinder", "segments": 6}'
  cage=$id
  get "/v1/models/$cage/surface.obj?level=2"
  dent answer >dented.obj
  sculpt "$cage" 2 dented.obj
  expect 201
  [ "$(header location)" = "/v1/models/$id" ]
  first=$id
  grep '^v ' dented.obj >bare.obj
  awk '/^v / { printf "%s[%s,%s,%s]", n++ ? "," : "{\"positions\":[", $2, $3, $4 } END { print "]}" }' dented.obj >points.json
  gojq '.positions |= flatten' points.json >flat.json
  gzip --keep dented.obj
  for arguments in '--header Content-Type:model/obj --data-binary @dented.obj' \
    '--header Content-Type:text/plain --data-binary @bare.obj' \
    '--header Content-Type:application/json --data-binary @points.json' \
    '--header Content-Type:application/json --data-binary @flat.json' \
    '--form file=@dented.obj' '--form file=@points.json' \
    '--header Content-Encoding:gzip --data-binary @dented.obj.gz'; do
    # shellcheck disable=SC2086 # several arguments
    http POST "/v1/models/$cage/detail?level=2" $arguments
    expect 200
    [ "$(value .id)" = "$first" ]
  done
}

@test "a mesh of two quads keeps its tags and what is modelled onto eight levels" {
  cat >quads.json <<'JSON'
{"meshes": [{"positions": [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, 1]],
  "faces": [[0, 3, 4, 1], [1, 4, 5, 2]],
  "creases": [{"edge": [1, 4], "sharpness": 2.5}], "corners": [{"vertex": 0, "sharpness": 10}]}]}
JSON
  upload quads.json
  for level in 1 2 3 4 5 6 7 8; do
    get "/v1/models/$id/surface.obj?level=$level"
    dent answer >dented.obj
    sculpt "$id" "$level" dented.obj
  done
  get "/v1/models/$id"
  [ "$(value '.meshes[0].details | length')" = 8 ]
  get "/v1/models/$id/surface.glb?level=0&polygons=ngon"
  expect 200
  cp answer kept.glb
  get "/v1/models/$id/surface.obj?level=3"
  cp answer shown.obj
  upload kept.glb
  get "/v1/models/$id/surface.obj?level=3"
  near answer shown.obj
}

@test "what is no level of the mesh is refused with its place, and nothing is stored" {
  upload_shape '{"kind": "box"}'
  before=$(count_models)
  get "/v1/models/$id/surface.obj?level=1"
  mv answer level.obj
  awk '/^v / && ++n == 8 { $3 = "nan" } 1' level.obj >nan.obj
  awk '/^v / && ++n == 8 { $3 = "1e30" } 1' level.obj >far.obj
  awk '/^v / && ++n == 8 { $3 = "" } 1' level.obj >short.obj
  sed '/^v /{x;s/^/x/;/^x\{8\}$/{x;d};x}' level.obj >few.obj
  : >empty
  json() { http POST "/v1/models/$id/detail?level=1" --header 'Content-Type: application/json' --data "$1"; }
  for file in few.obj empty; do
    post "/v1/models/$id/detail?level=1" "$file"
    [[ $status == 4?? ]]
    problem "$status"
  done
  post "/v1/models/$id/detail?level=2" level.obj
  problem 422 '26.*98|98.*26'
  post "/v1/models/$id/detail?level=1" nan.obj
  problem 422 'no finite'
  holds '.line == 10'
  post "/v1/models/$id/detail?level=1" far.obj
  problem 422
  holds '.errors[0].pointer == "/positions/7/1"'
  post "/v1/models/$id/detail?level=1" short.obj
  problem 400
  holds '.line == 10'
  json '{"positions": [[1, 2]]}'
  [[ $status == 4?? ]]
  holds '.errors[0].pointer | startswith("/positions/0")'
  gojq -n '[range(26)] | map([., 0, if . == 7 then 1e30 else 0 end]) | {positions: .}' >far.json
  post "/v1/models/$id/detail?level=1" far.json
  problem 422
  holds '.errors[0].pointer == "/positions/7/2"'
  json '{"positions": [1, 2, 3, 4]}'
  problem 422
  json '{"positions": [[0, 0, "x"]]}'
  [[ $status == 4?? ]]
  holds '.errors[0].pointer == "/positions/0/2"'
  for body in '{}' '[]' '{"positions": 3}' '{"points": [[0, 0, 0]]}' '{"positions": [[0, 0, 0]]' 'null'; do
    json "$body"
    [[ $status == 4?? ]]
    problem "$status"
  done
  json '{"positions": []}'
  problem 422
  http POST "/v1/models/$id/detail?level=1" --header 'Content-Type: image/png' --data-binary @level.obj
  problem 415
  http POST "/v1/models/$id/detail?level=1" --header 'Content-Encoding: gzip' --data-binary @level.obj
  problem 400
  for query in level=-1 level=a level=1.5 level= 'level=1&levels=1' 'level=1&details=false' 'level=1&level=2' ''; do
    post "/v1/models/$id/detail?$query" level.obj
    problem 400
  done
  for query in level=11 level=99 'level=1&mesh=tail'; do
    post "/v1/models/$id/detail?$query" level.obj
    problem 422
  done
  post "/v1/models/00000000000000000000000000000000/detail?level=1" level.obj
  problem 404
  get "/v1/models/$id/detail?level=1"
  problem 405
  [[ $(header allow) == *POST* ]]
  get "/v1/models/$id/surface.obj?level=1&details=maybe"
  problem 400
  [ "$(count_models)" = "$before" ]
}

# ---- models of several parts ---------------------------------------------------------------------

@test "of several meshes one is named, by the points of its own or of the whole model" {
  echo '{"meshes": [{"name": "a", "shape": {"kind": "box"}}, {"name": "b", "shape": {"kind": "icosphere", "level": 0}}],
    "nodes": [{"name": "n", "mesh": "b", "translation": [5, 0, 0]}, {"name": "m", "mesh": "a"}]}' >two.json
  upload two.json
  two=$id
  get "/v1/models/$two/surface.obj?level=1"
  mv answer whole.obj
  dent whole.obj >dented.obj
  post "/v1/models/$two/detail?level=1" dented.obj
  problem 422 mesh
  post "/v1/models/$two/detail?level=1&mesh=b" dented.obj
  expect 201
  holds '[.meshes[] | .details] == [[], [1]]'
  id=$(value .id)
  get "/v1/models/$id/surface.obj?level=1"
  own=$((12 + 30 + 20)) # vertices, edges and faces of the icosphere
  { grep '^v ' dented.obj | head -n "$own"; grep '^v ' whole.obj | tail -n +$((own + 1)); } >expected.obj
  near expected.obj answer 5e-6
}

@test "points are where surface.obj has them: the node's transform is taken off" {
  echo '{"meshes": [{"name": "hull", "shape": {"kind": "quad_sphere", "segments": 3}}],
    "nodes": [{"name": "root", "translation": [3, -2, 1], "scale": [2, 2, 2]},
              {"name": "hull", "parent": "root", "mesh": "hull", "rotation": [0, 0.6, 0, 0.8], "scale": [1, 3, 0.5]}]}' >placed.json
  upload placed.json
  as_cage
  plain=$id
  for level in 0 2 3; do
    get "/v1/models/$plain/surface.obj?level=$level"
    mv answer plain.obj
    sculpt "$plain" "$level" plain.obj
    [ "$id" = "$plain" ]
    dent plain.obj >dented.obj
    sculpt "$plain" "$level" dented.obj
    sculpted=$id
    get "/v1/models/$sculpted/surface.obj?level=$level"
    mv answer shown.obj
    near dented.obj shown.obj 1e-5
    sculpt "$sculpted" "$level" shown.obj
    [ "$id" = "$sculpted" ]
  done
  sed 's/"scale": \[1, 3, 0.5\]/"scale": [1, 0, 0.5]/' placed.json >flat.json
  upload flat.json
  post "/v1/models/$id/detail?level=3" dented.obj
  problem 422 'no size'
}

@test "posed surfaces keep what is modelled" {
  upload "$samples/tank.json"
  get "/v1/models/$id"
  mesh=$(value '.meshes[0].name')
  get "/v1/models/$id/surface.json?level=1"
  rows=$(value '.meshes[0].vertices')
  # Points far from all: each gets a detail.
  awk -v n="$rows" 'BEGIN { for (i = 0; i < n; i++) print "v", i % 7, i % 3, i % 5 }' >points.obj
  post "/v1/models/$id/detail?level=1&mesh=$mesh" points.obj
  expect 201
  id=$(value .id)
  for query in 'level=2&at=0.5' 'level=1&at=0,1' 'level=2&at=0.5&skin=bake'; do
    get "/v1/models/$id/surface.glb?$query"
    expect 200
    cp answer shown.glb
    get "/v1/models/$id/surface.glb?$query&details=false"
    expect 200
    differ answer shown.glb
  done
}

@test "details are of no bilinear surface, and of an open one where that keeps all points" {
  for shape in '{"kind": "box"}' '{"kind": "grid", "segments": [2, 2]}'; do
    upload_shape "$shape"
    get "/v1/models/$id/surface.obj?level=1"
    dent answer >dented.obj
    sculpt "$id" 1 dented.obj
    for level in 0 1 2; do
      get "/v1/models/$id/surface.glb?level=$level&scheme=bilinear"
      problem 422 'scheme=bilinear is not what details are modelled by'
      get "/v1/models/$id/surface.glb?level=$level&scheme=bilinear&details=false"
      expect 200
    done
    get "/v1/models/$id/surface.obj?level=2"
    cp answer closed.obj
    get "/v1/models/$id/surface.obj?level=2&boundary=open"
    if [[ $shape == *grid* ]]; then
      problem 422 'boundary=open takes points away'
    else
      cmp answer closed.obj
    fi
  done
}
