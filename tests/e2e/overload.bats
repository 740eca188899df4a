# More work than the daemon has threads, and more memory than it may hold.

load helper
setup() { cd "$BATS_TEST_TMPDIR" || return; }
teardown() { stop_daemon; }

# resident PEAK|NOW: megabytes.
resident() {
  local field=VmRSS
  [[ $1 == NOW ]] || field=VmHWM
  awk -v field="$field:" '$1 == field { print int($2 / 1024) }' "/proc/$daemon/status"
}

@test "who asks for a surface that is being made holds neither a thread nor a place in the queue" {
  needs_process
  start_daemon --threads 2 --queue 1
  grid 500 >large.obj
  upload large.obj
  for i in $(seq 6); do # more than threads and queue hold
    {
      curl --silent --output "out-$i" --write-out '%{http_code}\n' "$url/v1/models/$id/surface.glb?level=2" >"code-$i"
      echo surface >>order
    } 3>&- &
  done
  # Once one of them is at work, a small model that nobody knows yet is answered before all of them.
  until curl --silent "$url/metrics" | grep -qE '^tweend_compute_threads_busy [1-9]'; do sleep 0.01; done
  post "/v1/surface.glb?level=2" "$samples/cube.obj"
  echo cube >>order
  expect 200
  wait $(jobs -p | grep -vx "$daemon")
  cat code-* order
  [ "$(sort -u code-*)" = 200 ]
  [ "$(head -n 1 order)" = cube ]
  for i in $(seq 2 6); do cmp out-1 "out-$i"; done
}

# mesh_obj N: N x N points as programs write them, two triangles a cell.
mesh_obj() {
  awk -v n="$1" 'BEGIN {
    for (y = 0; y < n; y++) for (x = 0; x < n; x++) printf "v %.6f %.6f %.6f\n", x / n, (x * y) % 7 / n, y / n
    for (y = 0; y < n - 1; y++) for (x = 1; x < n; x++) {
      a = y * n + x
      printf "f %d %d %d\nf %d %d %d\n", a, a + 1, a + n + 1, a, a + n + 1, a + n
    }
  }'
}

# bats test_tags=plain
@test "an upload of OBJ holds at most twice its bytes beside its file" {
  needs_process
  start_daemon
  mesh_obj 900 >mesh
  size=$(($(stat -c %s mesh) >> 20))
  before=$(resident PEAK)
  upload mesh
  grown=$(($(resident PEAK) - before))
  echo "$size MB, $grown MB more resident"
  ((size > 50 && grown < 3 * size)) # once the file's own pages, which are mapped
}

# bats test_tags=plain
@test "in a group of 512 MB four large uploads at once are stored or told to come again" {
  needs_process
  limit_group memory memory.limit_in_bytes=512M memory.max=512M
  start_daemon
  curl --silent "$url/metrics" | grep -qx "tweend_memory_limit_bytes $((384 << 20))"
  mesh_obj 1000 >mesh
  for i in 1 2 3 4 5; do { echo "# $i"; cat mesh; } >"mesh-$i"; done
  senders=()
  for i in 1 2 3 4; do
    curl --silent --dump-header "head-$i" --output "out-$i" --write-out '%{http_code}\n' --data-binary "@mesh-$i" \
      "$url/v1/models" >"code-$i" 3>&- &
    senders+=($!)
  done
  wait "${senders[@]}"
  cat code-*
  for i in 1 2 3 4; do
    grep -qx 201 "code-$i" || { grep -qx 503 "code-$i" && grep -qi '^Retry-After: ' "head-$i"; }
  done
  upload mesh-5
  stop_daemon # with status 0: it was not killed
}

# Median of the seconds that a health check on a connection of its own takes, of 7.
health_median() {
  for _ in $(seq 7); do
    curl --silent --fail --output /dev/null --write-out '%{time_total}\n' "$url/healthz" || return
    pause 0.1
  done | sort -n | sed -n 4p
}

loopback_bytes() { cat /sys/class/net/lo/statistics/tx_bytes; }

# bats test_tags=plain
@test "400 readers of a large warm surface do not delay a health check" {
  needs_process
  start_daemon
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.glb?level=6" # makes it
  expect 200
  clients=()
  for _ in 1 2; do
    # The part behind # is not sent: it makes as many requests.
    curl --silent --no-progress-meter --parallel --parallel-max 200 --parallel-immediate --max-time 60 --output /dev/null \
      "$url/v1/models/$id/surface.glb?level=6#[1-2000]" 3>&- &
    clients+=($!)
  done
  for ((tries = 0; tries < 300; tries++)); do
    (($(curl --silent "$url/metrics" | sed -n 's/^tweend_http_connections //p') <= 400)) || break
    pause 0.1
  done
  sent=$(loopback_bytes) begin=$EPOCHREALTIME
  loaded=$(health_median)
  sent=$(($(loopback_bytes) - sent)) took=$((${EPOCHREALTIME/./} - ${begin/./})) # microseconds
  kill "${clients[@]}" # fails where they have ended before
  # 200 ms, or where the machine has more to do than this, few blocks for each reader.
  awk -v loaded="$loaded" -v rate=$((sent / took)) 'BEGIN {
    printf "median %s s, in which readers get %.0f MB\n", loaded, loaded * rate
    exit !(loaded < 0.2 || loaded * rate < 50) }'
}

# bats test_tags=plain
@test "slow readers of large models hold no more than the budget, and the memory comes back" {
  needs_process
  start_daemon --max-memory 96MiB --plan-cache 16MiB
  grid 300 >large.obj
  for i in $(seq 24); do
    # Takes what fits a pipe, and no more.
    curl --silent --dump-header "head-$i" --data-binary @large.obj "$url/v1/surface.glb?level=2" > >(sleep 8 3>&-) 3>&- &
  done
  sleep 6
  peak=$(resident PEAK)
  for ((tries = 0; tries < 10; tries++)); do # as Retry-After asks a client to
    post "/v1/surface.glb?level=1" "$samples/cube.obj"
    [[ $status == 200 ]] && break
    sleep 1
  done
  expect 200
  wait $(jobs -p | grep -vx "$daemon") || true
  echo "peak $peak MB"
  ((peak < 96 + 64))
  served=0
  for i in $(seq 24); do
    [[ -s head-$i ]] || continue # waits for memory until it leaves
    if grep -q '^HTTP/1.1 200' "head-$i"; then
      served=$((served + 1))
    else
      grep -q '^HTTP/1.1 503' "head-$i"
      grep -qi '^Retry-After: ' "head-$i"
    fi
  done
  ((served >= 1))
  # The load is over when the daemon has noticed that all have left.
  for ((tries = 0; tries < 600; tries++)); do
    ! curl --silent "$url/metrics" | grep -qx 'tweend_http_requests_in_flight 1' || break
    pause 0.1
  done
  for ((tries = 0; tries < 100; tries++)); do
    (($(resident NOW) >= 16 + 64)) || break
    pause 0.1
  done
  (($(resident NOW) < 16 + 64))
}

# all_served_within MEGABYTES: the requests under way get 200, and the peak is less than so much over `before`.
all_served_within() {
  wait $(jobs -p | grep -vx "$daemon")
  cat code-*
  local grown=$(($(resident PEAK) - before))
  echo "$grown MB more resident"
  [ "$(sort -u code-*)" = 200 ]
  ((grown < $1))
}

# bats test_tags=plain
@test "surfaces that are made step by step wait for memory in proportion to their points" {
  needs_process
  start_daemon --max-memory 128MiB --threads 4
  grid_of_triangles='BEGIN { for (i = 0; i < 81; i++) printf "v %d %d %d\n", i % 9, i / 9, i % 2
    for (y = 0; y < 8; y++) for (x = 1; x < 9; x++) {
      a = 9 * y + x
      printf "f %d %d %d\nf %d %d %d\n", a, a + 1, a + 10, a, a + 10, a + 9
    } }'
  awk "$grid_of_triangles" >plain
  before=$(resident PEAK)
  for i in $(seq 6); do
    { cat plain; echo "# $i"; } >"body-$i"
    query='scheme=loop&limit=true&level=6'
    ((i % 2)) || query='boundary=open&level=5'
    curl --silent --output /dev/null --write-out '%{http_code}\n' --data-binary "@body-$i" "$url/v1/surface.glb?$query" >"code-$i" 3>&- &
  done
  all_served_within 160 # of some 400 that they take together
}

# skinned_nodes COUNT: a glTF of as many nodes that show one skinned grid of 1,800 triangles, whose joint turns.
skinned_nodes() {
  node -e '
    const n = 30, nodes = Number(process.argv[1]), points = [], faces = [];
    for (let i = 0; i < (n + 1) ** 2; i++) points.push(i % (n + 1), Math.floor(i / (n + 1)), i % 5 / 9);
    for (let i = 0, at; i < n * n; i++) {
      at = i + Math.floor(i / n);
      faces.push(at, at + 1, at + n + 2, at, at + n + 2, at + n + 1);
    }
    const count = points.length / 3, one = new Array(count).fill([1, 0, 0, 0]).flat();
    const data = [new Float32Array(points), new Uint32Array(faces), new Uint8Array(4 * count), new Float32Array(one),
      new Float32Array([0, 1]), new Float32Array([0, 0, 0, 1, 0, 0, 1, 0])].map(({ buffer }) => Buffer.from(buffer));
    let end = 0;
    const bufferViews = data.map(({ length }) => ({ buffer: 0, byteOffset: (end += length) - length, byteLength: length }));
    const of = (bufferView, componentType, count, type, more) => ({ bufferView, componentType, count, type, ...more });
    const json = JSON.stringify({ asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [...Array(nodes + 1).keys()] }],
      nodes: [{}, ...Array(nodes).fill({ mesh: 0, skin: 0 })], skins: [{ joints: [0] }],
      meshes: [{ primitives: [{ attributes: { POSITION: 0, JOINTS_0: 2, WEIGHTS_0: 3 }, indices: 1 }] }],
      animations: [{ samplers: [{ input: 4, output: 5 }], channels: [{ sampler: 0, target: { node: 0, path: "rotation" } }] }],
      accessors: [of(0, 5126, count, "VEC3", { min: [0, 0, 0], max: [n, n, 1] }), of(1, 5125, faces.length, "SCALAR"), of(2, 5121, count, "VEC4"),
        of(3, 5126, count, "VEC4"), of(4, 5126, 2, "SCALAR", { min: [0], max: [1] }), of(5, 5126, 2, "VEC4")],
      bufferViews, buffers: [{ byteLength: end, uri: "data:application/octet-stream;base64," + Buffer.concat(data).toString("base64") }] });
    process.stdout.write(json);' "$1"
}

# bats test_tags=plain
@test "skinned surfaces of many nodes wait for the memory of all of them" {
  needs_process
  start_daemon --max-memory 160MiB --threads 4
  for i in 1 2 3 4; do skinned_nodes $((300 + i)) >"body-$i"; done
  before=$(resident PEAK)
  for i in 1 2 3 4; do
    curl --silent --output /dev/null --write-out '%{http_code}\n' --data-binary "@body-$i" \
      "$url/v1/surface.glb?skin=bake&at=0.5&level=2" >"code-$i" 3>&- &
  done
  all_served_within 165 # two at once take 220
}

@test "a request is served whose bound is over the budget, and refused where it really needs more" {
  needs_process
  start_daemon --max-memory 160MiB
  grid 400 >large.obj
  post "/v1/surface.glb?level=2" large.obj # its bound is 235 MB
  expect 200
  stop_daemon
  start_daemon --max-memory 16MiB
  post "/v1/surface.glb?level=2" large.obj
  problem 422 '--max-memory'
  curl --silent "$url/metrics" | grep -q '^tweend_refusals_total{reason="memory"} 1$'
}

# bats test_tags=plain
@test "counting an open border and making it hold no more than --max-memory" {
  needs_process
  start_daemon --max-memory 128MiB
  shape='{"meshes":[{"shape":{"kind":"grid","size":[1,1],"segments":[700,700]}}]}'
  for form in json glb; do
    http POST "/v1/surface.$form?level=2&boundary=open" --header 'Content-Type: application/json' --data "$shape"
    problem 422 '--max-memory'
    holds ".predicted.faces == $((2794 * 2794))"
    (($(resident PEAK) < 128 + 64))
  done
}

@test "a request that waits too long for memory gets 503" {
  needs_process
  start_daemon --max-memory 160MiB --request-timeout 2s --min-rate 0
  grid 400 >large.obj
  curl --silent --dump-header slow --data-binary @large.obj "$url/v1/surface.glb?level=3" > >(sleep 8 3>&-) 3>&- &
  until [[ -s slow ]]; do sleep 0.1; done
  post "/v1/surface.glb?level=2" large.obj
  problem 503 'too long'
  [ -n "$(header retry-after)" ]
}

@test "slow readers of small models keep nobody waiting" {
  needs_process
  (
    start_daemon --max-memory 96MiB --request-timeout 30s --min-rate 0
    trap 'kill $(jobs -p | grep -vx "$daemon"); stop_daemon' EXIT
    upload "$samples/cube.obj"
    for i in 1 2; do
      curl --silent --dump-header "slow-$i" "$url/v1/models/$id/surface.glb?level=8" > >(sleep 60 3>&-) 3>&- &
    done
    until [[ -s slow-1 && -s slow-2 ]]; do sleep 0.1; done
    grid 300 >large.obj
    post "/v1/surface.json?level=2" large.obj # its bound is over the budget, so it has to be alone
    expect 200
  )
}

# long_obj NUMBER: a model of 2 MiB in the file long-NUMBER.
long_obj() {
  { cat "$samples/cube.obj"; printf '# %s\n' "$1"; head -c 2M /dev/zero | tr '\0' '\n'; } | head -c 2M >"long-$1"
}

# send_slowly NUMBER [CURL ARGUMENT...]: uploads it within seconds; its status comes into code-NUMBER.
send_slowly() {
  curl --silent --limit-rate 400k --dump-header "head-$1" --output "out-$1" --write-out '%{http_code}\n' \
    --header 'Expect: 100-continue' --data-binary "@long-$1" "${@:2}" "$url/v1/models" >"code-$1" 3>&- &
  senders+=($!)
}

# spooled BYTES: before long, so many are.
spooled() {
  local tries
  for ((tries = 0; tries < 300; tries++)); do
    ! curl --silent "$url/metrics" | grep -qx "tweend_spool_bytes $1" || return 0
    pause 0.05
  done
  curl --silent "$url/metrics" | grep tweend_spool
  return 1
}

@test "of racing slow uploads those over --spool-limit are 503, the others are stored, and the room comes back" {
  needs_process
  start_daemon --max-upload 2MiB --spool-limit 8MiB
  for round in 1 2; do
    for i in $(seq 12); do long_obj "$round-$i"; done
    senders=()
    for i in $(seq 12); do
      way=()
      ((i % 2)) || way=(--header 'Transfer-Encoding: chunked')
      send_slowly "$round-$i" "${way[@]}"
    done
    upload "$samples/cube.obj" # short bodies stay in memory
    while kill -0 "${senders[@]}" 2>/dev/null; do
      (($(curl --silent "$url/metrics" | awk '/^tweend_spool_bytes / { print $2 }') <= 8 << 20))
      pause 0.1 # some fifty looks are enough
    done
    wait "${senders[@]}"
    cat code-"$round"-* | sort | uniq -c
    stored=$(cat code-"$round"-* | grep -cx 201)
    ((stored >= 1 && stored < 12)) # on a busy machine the last come when the first are stored
    [ "$(sort -u code-"$round"-* | tr '\n' ' ')" = "201 503 " ]
    for i in $(seq 12); do
      grep -qx 201 "code-$round-$i" || grep -qi '^Retry-After: ' "head-$round-$i"
    done
    spooled 0
  done
}

@test "an upload that --spool-limit refuses is refused on its headers, and other requests go on" {
  needs_process
  start_daemon --max-upload 2MiB --spool-limit 4MiB
  for i in 1 2 3; do long_obj $i; done
  senders=()
  send_slowly 1
  send_slowly 2
  spooled $((4 << 20))
  status=$(curl --silent --output answer --dump-header headers --write-out '%{http_code} %{size_upload}' \
    --data-binary @long-3 --header 'Expect: 100-continue' --expect100-timeout 10 "$url/v1/models")
  [ "${status##* }" = 0 ]
  status=${status%% *}
  problem 503 'under way'
  [ -n "$(header retry-after)" ]
  curl --silent "$url/metrics" | grep -qx 'tweend_refusals_total{reason="spool"} 1'
  post "/v1/surface.glb" "$samples/cube.obj"
  expect 200
  wait "${senders[@]}"
  [ "$(cat code-1 code-2)" = $'201\n201' ]
  post /v1/models long-3
  expect 201
}

@test "uploads whose clients vanish, stall or send what is no model leave their room" {
  needs_process
  start_daemon --max-upload 2MiB --spool-limit 4MiB --min-rate 0
  for i in 1 2; do long_obj $i; done
  for framing in 'Content-Type: model/obj' 'Transfer-Encoding: chunked'; do # with Content-Length, without
    senders=()
    send_slowly 1 --header "$framing" --limit-rate 250k
    send_slowly 2 --header "$framing" --limit-rate 250k
    for ((tries = 0; tries < 200; tries++)); do
      (($(curl --silent "$url/metrics" | sed -n 's/^tweend_spool_bytes //p') <= 2 << 20)) || break
      pause 0.05
    done
    ((tries < 200))
    kill "${senders[@]}"
    spooled 0
  done
  stop_daemon
  start_daemon --max-upload 2MiB --spool-limit 4MiB --min-rate 0 --request-timeout 3s
  senders=()
  send_slowly 1 --limit-rate 200k
  wait "${senders[@]}" || true
  grep -q 408 code-1
  spooled 0
  stop_daemon
  start_daemon --max-upload 2MiB --spool-limit 4MiB
  spooled 0
  head -c 2M /dev/zero | tr '\0' '\n' >nothing
  post /v1/models nothing
  [[ $status == 4?? ]]
  http POST /v1/models --form "file=@long-1;filename=long.obj" # with the form round it too long
  problem 413
  spooled 0
  long_obj 3
  head -c 1900k long-3 >shorter.obj
  http POST /v1/models --form "file=@shorter.obj"
  expect 201
  spooled 0
}
