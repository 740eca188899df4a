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
points() { glb_json "$1" | jq '.accessors[.meshes[0].primitives[0].attributes.POSITION].count'; }

# triangles FILE: of its first primitive.
triangles() { glb_json "$1" | jq '.accessors[.meshes[0].primitives[0].indices].count / 3'; }

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

@test "level 0 is the cage" {
  get "$cube/surface.json?level=0"
  holds '.vertices == 8 and .edges == 12 and .faces == 6'
  get "$cube/surface.obj?level=0"
  [ "$(obj_points answer)" = 8 ]
  [ "$(obj_faces answer)" = 6 ]
}

@test "the counts hold at level 10, which nothing computed" {
  get "$cube/surface.json?level=10"
  expect 200
  # F = 6 * 4^10, E = 2 F, V = F + 2 on a sphere of quads.
  holds '.faces == 6291456 and .edges == 12582912 and .vertices == 6291458'
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

@test "a grid of 4 x 4 points with open borders becomes 25 points, then 49" {
  grid 4 >grid.obj
  upload grid.obj
  for expected in 1:25:16 2:49:36; do
    IFS=: read -r level vertices faces <<<"$expected"
    get "/v1/models/$id/surface.json?level=$level&boundary=open"
    holds ".vertices == $vertices and .faces == $faces"
    get "/v1/models/$id/surface.glb?level=$level&boundary=open"
    [ "$(points answer)" = "$vertices" ]
    get "/v1/models/$id/surface.obj?level=$level&boundary=open"
    [ "$(obj_points answer)" = "$vertices" ]
    [ "$(obj_faces answer)" = "$faces" ]
  done
}

@test "open borders shrink from the mesh's border and not from a hole" {
  { grid 6; printf 't hole 1/0/0 12\n'; } >holed.obj
  upload holed.obj
  # 9 x 9 points, the middle of the hole missing; then 15 x 15 without 3 x 3.
  for expected in 1:80:60 2:216:180; do
    IFS=: read -r level vertices faces <<<"$expected"
    get "/v1/models/$id/surface.json?level=$level&boundary=open"
    expect 200
    holds ".vertices == $vertices and .faces == $faces"
    get "/v1/models/$id/surface.obj?level=$level&boundary=open"
    [ "$(obj_points answer)" = "$vertices" ]
    [ "$(obj_faces answer)" = "$faces" ]
  done
}

# extent FILE: the largest x among the points of an OBJ; of a grid of 4 points it is 3 at most.
extent() { awk '$1 == "v" && $2 > x { x = $2 } END { printf "%.4f\n", x }' "$1"; }

@test "each boundary rule treats the border in its way" {
  grid 4 >grid.obj
  upload grid.obj
  for rule in edge-and-corner edge-only none; do
    get "/v1/models/$id/surface.obj?level=3&boundary=$rule"
    expect 200
    cp answer "$rule.obj"
  done
  # Corners stay; corners are rounded off; the faces at the border are left out.
  grep -q '^v 0 0 0$' edge-and-corner.obj
  grep -q '^v 3 3 0$' edge-and-corner.obj
  if grep -q '^v 0 0 0$' edge-only.obj; then false; fi
  [ "$(extent edge-only.obj)" = 3.0000 ]
  [ "$(obj_faces edge-only.obj)" = $((9 * 64)) ]
  [ "$(obj_faces none.obj)" = 64 ]
  get "/v1/models/$id/surface.json?level=3&boundary=none"
  holds '.faces == 64 and .vertices == 81'
}

@test "mixed polygons become quads, one a corner" {
  printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 0.5 0\nv 2 0.5 1\nf 1 2 3 4 5\nf 2 6 3\n' >mixed.obj
  upload mixed.obj
  get "/v1/models/$id/surface.json"
  # V' = 6 + 7 + 2, E' = 2 * 7 + 8, F' = 8
  holds '.vertices == 15 and .edges == 22 and .faces == 8'
  get "/v1/models/$id/surface.obj"
  [ "$(grep -c '^f \S* \S* \S* \S*$' answer)" = 8 ]
}

# ---- points --------------------------------------------------------------------------------------

# corner LEVEL: how far the surface goes towards the cube's corner, (x + y + z) / 3.
corner() {
  get "$cube/surface.obj?level=$1"
  awk '$1 == "v" { s = ($2 + $3 + $4) / 3; if (s > m) m = s } END { printf "%.9f\n", m }' answer
}

@test "the cube's corner approaches its limit, half of it, monotonically" {
  # At a point of valence 3: (9 P + 4 sum of neighbours + sum of opposite corners) / 24 = 0.5.
  before=1
  for level in 1 2 3 4 5 6; do
    now=$(corner $level)
    awk -v now="$now" -v before="$before" 'BEGIN { exit !(now < before && now > 0.5) }'
    before=$now
  done
  awk -v now="$now" 'BEGIN { exit !(now - 0.5 < 1e-3) }'
}

@test "one step by hand: the corner at 5/9, the edge at 3/4, the face in the middle" {
  get "$cube/surface.obj?level=1"
  awk '$1 == "v" {
    a = $2 < 0 ? -$2 : $2; b = $3 < 0 ? -$3 : $3; c = $4 < 0 ? -$4 : $4
    printf "%.5f\n", a + b + c }' answer | sort | uniq -c | awk '{ print $1, $2 }' >sums
  diff sums <(printf '6 1.00000\n12 1.50000\n8 1.66667\n')
}

@test "bilinear keeps the shape" {
  get "$cube/surface.json?level=3&scheme=bilinear"
  holds '.faces == 384'
  get "$cube/surface.glb?level=3&scheme=bilinear"
  glb_json answer | jq -e '.accessors[.meshes[0].primitives[0].attributes.POSITION] |
    .min == [-1, -1, -1] and .max == [1, 1, 1]'
}

@test "POSITION bounds are those of the points" {
  get "$cube/surface.obj?level=2"
  awk '$1 == "v" { for (i = 2; i < 5; i++) if ($i > m) m = $i } END { print m }' answer >greatest
  get "$cube/surface.glb?level=2"
  glb_json answer | jq '.accessors[.meshes[0].primitives[0].attributes.POSITION].max | max' >bound
  awk 'NR == 1 { a = $1 } NR == 2 { b = $1 } END { exit !(a - b < 1e-6 && b - a < 1e-6) }' greatest bound
}

@test "the octopus keeps its texture coordinates, split at the seams only" {
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.json?level=2"
  welded=$(value .vertices)
  get "/v1/models/$id/surface.glb?level=2"
  expect 200
  glb_json answer | jq -e '.meshes[0].primitives | all(.attributes | has("TEXCOORD_0") and has("NORMAL"))'
  drawn=$(points answer)
  [ "$drawn" -gt "$welded" ]
  [ "$drawn" -lt $((welded * 6 / 5)) ]
  get "/v1/models/$id/surface.obj?level=2"
  [ "$(obj_points answer)" = "$welded" ]
  [ "$(obj_faces answer)" = $((288 * 16)) ]
  grep -q '^vt ' answer
}

@test "normals=none leaves the normals out" {
  get "$cube/surface.glb?level=2"
  glb_json answer | jq -e '.meshes[0].primitives[0].attributes | has("NORMAL")'
  size=$(stat -c %s answer)
  get "$cube/surface.glb?level=2&normals=none"
  glb_json answer | jq -e '.meshes[0].primitives[0].attributes | has("NORMAL") | not'
  [ "$(stat -c %s answer)" -lt "$size" ]
}

# ---- forms ---------------------------------------------------------------------------------------

@test "without an ending the Accept header decides, GLB by default" {
  get "$cube/surface"
  [ "$(header content-type)" = model/gltf-binary ]
  [[ $(header vary) == *[Aa]ccept* ]]
  get "$cube/surface" --header 'Accept: model/obj'
  [[ $(header content-type) == model/obj* ]]
  get "$cube/surface" --header 'Accept: application/json'
  [[ $(header content-type) == application/json* ]]
  get "$cube/surface" --header 'Accept: model/gltf+json;q=0.5, image/png, model/obj;q=0.1'
  [[ $(header content-type) == model/gltf+json* ]]
  get "$cube/surface" --header 'Accept: image/png'
  problem 406
}

@test "the glTF form says the same as the GLB" {
  get "$cube/surface.glb?level=2"
  glb_json answer >glb.json
  tail -c +$((29 + $(od -An -tu4 -j12 -N4 answer))) answer >glb.bin
  get "$cube/surface.gltf?level=2"
  [[ $(header content-type) == model/gltf+json* ]]
  holds '.buffers[0].uri | startswith("data:application/")'
  diff <(jq -S 'del(.buffers)' glb.json) <(jq -S 'del(.buffers)' answer)
  value '.buffers[0].uri' | sed 's/^[^,]*,//' | base64 --decode >gltf.bin
  # The chunk of a GLB may end in up to three bytes of padding.
  cmp --bytes="$(stat -c %s gltf.bin)" gltf.bin glb.bin
  [ $(($(stat -c %s glb.bin) - $(stat -c %s gltf.bin))) -lt 4 ]
}

@test "HEAD tells the size of a GLB and computes nothing" {
  get "$cube/surface.json?level=10"
  bytes=$(value .bytes)
  http HEAD "$cube/surface.glb?level=10" --max-time 20
  expect 200
  [ "$(header content-length)" = "$bytes" ]
}

@test "the same question twice has the same bytes and the same ETag" {
  get "$cube/surface.glb?level=4"
  etag=$(header etag)
  cp answer first.glb
  get "$cube/surface.glb?level=4"
  cmp first.glb answer
  [ "$(header etag)" = "$etag" ]
  get "$cube/surface.glb?level=3"
  [ "$(header etag)" != "$etag" ]
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
  jq -c '[.nodes, .poses[0].rotation] | transpose | map({key: .[0], value: .[1]}) | from_entries' answer >pose
  get "/v1/models/$id/surface.glb?level=1&clip=drive&at=1.7"
  expect 200
  glb_json answer >posed.json
  jq -e '.animations == null' posed.json
  jq -e --slurpfile pose pose '
    [.nodes[] | select(.name == "hull" or .name == "turret" or .name == "barrel")] |
    length == 3 and all(. as $node | [.rotation, $pose[0][$node.name]] | transpose | all((.[0] - .[1]) | fabs < 1e-6))' posed.json
}

@test "clip alone keeps the clip as an animation" {
  upload "$samples/tank.json"
  get "/v1/models/$id/surface.glb?level=1&clip=aim"
  expect 200
  glb_json answer | jq -e '(.animations | length) == 1 and .animations[0].name == "aim" and
    ([.animations[0].channels[].target.path] | unique) == ["rotation"]'
}

@test "the tank's surface has a mesh for each of its meshes and a node for each of its nodes" {
  upload "$samples/tank.json"
  get "/v1/models/$id/surface.json?level=2"
  holds '.meshes | length == 5'
  holds '.faces == ([.meshes[].faces] | add)'
  get "/v1/models/$id/surface.glb?level=2"
  glb_json answer | jq -e '(.meshes | length) == 5 and (.nodes | length) == 9 and .asset.version == "2.0"'
}

# ---- refusals ------------------------------------------------------------------------------------

@test "an unknown parameter is refused, and the known ones are named" {
  get "$cube/surface.glb?levl=2"
  problem 400 levl
  for known in level scheme boundary normals; do [[ $(value .detail) == *$known* ]]; done
}

@test "a parameter twice is refused" {
  get "$cube/surface.glb?level=1&level=2"
  problem 400 level
}

@test "values that do not fit are refused by the parameter's name" {
  for query in level=-1 level=x level=1.5 level= level=99999999999999999999 boundary=closed scheme=doo-sabin normals=flat; do
    get "$cube/surface.glb?$query"
    problem 400 "${query%%=*}"
  done
}

@test "at without clip, clip without a clip, a time that is none" {
  upload "$samples/tank.json"
  get "/v1/models/$id/surface.glb?clip=drive&at=soon"
  problem 400 at
  get "/v1/models/$id/surface.glb?clip=dance"
  [[ $status == 4* ]]
  problem "$status" dance
  get "$cube/surface.glb?clip=drive"
  [[ $status == 4* ]]
  problem "$status"
}

@test "loop on quads is refused with the reason" {
  get "$cube/surface.glb?scheme=loop"
  [[ $status == 400 || $status == 422 ]]
  problem "$status"
}

@test "times bake keys, a tolerance leaves few, meshes=none leaves the animation" {
  upload "$samples/tank.json"
  tank=/v1/models/$id
  get "$tank/surface.glb?level=0&clip=drive&from=0&to=4&fps=2"
  expect 200
  glb_json answer | jq -e '. as $g | [.animations[0].samplers[].input] | unique | all($g.accessors[.] | .count == 9 and .min == [0] and .max == [4])'
  get "$tank/surface.glb?meshes=none&clip=drive"
  expect 200
  [[ $(header x-tweend-error) =~ ^degrees=0\.0[0-9]+,\ metres=0\.0+$ ]]
  kept=$(header content-length)
  glb_json answer | jq -e 'has("meshes") == false and (.nodes | length) == 9 and (.animations | length) == 1'
  get "$tank/surface.glb?meshes=none&clip=drive&tolerance=2&tolerance_m=0.1"
  expect 200
  (($(header content-length) <= kept))
  awk -F"[=,]" "{ exit !(\$2 > 0.1 && \$2 <= 2) }" <<<"$(header x-tweend-error)"
  get "$tank/surface.glb?level=1&at=1&skin=bake"
  expect 200
}
