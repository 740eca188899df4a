# What /metrics tells of traffic of every kind.

load helper

setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
}
teardown() { stop_daemon; }

# metric NAME[{LABELS}]: its value now. ${as[@]}: arguments for curl.
as=()
metric() {
  curl --silent --fail "${as[@]}" "$url/metrics" |
    awk -v name="$1" 'index($0, name " ") == 1 { print $2; found = 1 } END { exit !found }'
}

# counts NAME VALUE: at once, or before long: a request counts when it has ended, which its client may know first.
counts() {
  local counted tries
  for ((tries = 0; tries < 500; tries++)); do
    counted=$(metric "$1") || { echo "$1 is missing"; return 1; }
    [ "$counted" != "$2" ] || return 0
    pause 0.01
  done
  echo "$1 is $counted, not $2"
  return 1
}

# refused REASON COUNT
refused() { counts "tweend_refusals_total{reason=\"$1\"}" "$2"; }

@test "promtool finds nothing to say after traffic of every kind" {
  start_daemon --store-limit 1MiB --spool-limit 256MiB
  upload "$samples/tank.json"
  for path in "" /source /tracks /surface.glb /surface.gltf /surface.obj /surface.json /pose.json /pose.csv /nothing; do
    get "/v1/models/$id$path"
  done
  curl --silent --max-time 10 "$url/v1/models/$id/live?clip=drive&speed=20" >/dev/null
  post "/v1/surface.glb?encoding=meshopt" "$samples/cube.obj"
  get "/v1/models?limit=0"
  http BREW /v1/models
  http DELETE "/v1/models/$id"
  get /metrics
  expect 200
  run promtool check metrics <answer
  [[ $status == 0 && -z $output ]]
  # No label comes from a client: as many routes as there are, and "other".
  if grep -E "$id|BREW|nothing" answer; then false; fi
}

@test "what a model's requests make is counted as made once, and as found from then on" {
  start_daemon
  post /v1/models "$samples/tank.json"
  id=$(value .id)
  counts 'tweend_cache_misses_total{kind="plan"}' 0
  get "/v1/models/$id/surface.glb?level=2&clip=none"
  expect 200
  counts 'tweend_cache_misses_total{kind="plan"}' 1
  hits=$(metric 'tweend_cache_hits_total{kind="plan"}')
  get "/v1/models/$id/surface.glb?level=2&clip=none"
  expect 200
  counts 'tweend_cache_misses_total{kind="plan"}' 1
  counts 'tweend_cache_hits_total{kind="plan"}' $((hits + 1))
  get "/v1/models/$id"
  counts 'tweend_cache_misses_total{kind="answer"}' 1
  get "/v1/models/$id"
  counts 'tweend_cache_misses_total{kind="answer"}' 1
  counts 'tweend_cache_misses_total{kind="clip"}' 0
  get "/v1/models/$id/pose.json?at=1"
  counts 'tweend_cache_misses_total{kind="clip"}' 1
  for kind in model plan clip answer; do
    (($(metric "tweend_memory_bytes{kind=\"$kind\"}") > 0))
  done
  http DELETE "/v1/models/$id"
  for kind in model plan clip answer; do
    counts "tweend_memory_bytes{kind=\"$kind\"}" 0
    counts "tweend_cache_evictions_total{kind=\"$kind\"}" 0
  done
}

@test "a cache without room evicts what it is given" {
  start_daemon --plan-cache 0
  upload "$samples/cube.obj"
  counts 'tweend_cache_evictions_total{kind="model"}' 1
  get "/v1/models/$id/surface.json"
  counts 'tweend_cache_evictions_total{kind="plan"}' 1
  counts 'tweend_memory_bytes{kind="plan"}' 0
}

@test "faces and joint-times count as they are computed" {
  start_daemon
  upload "$samples/cube.obj"
  get "/v1/models/$id/surface.json?level=3"
  counts tweend_faces_computed_total 0
  get "/v1/models/$id/surface.glb?level=3"
  counts tweend_faces_computed_total 384
  get "/v1/models/$id/surface.obj?level=3"
  counts tweend_faces_computed_total 768
  http HEAD "/v1/models/$id/surface.glb?level=3"
  counts tweend_faces_computed_total 768
  get "/v1/models/$id/surface.glb?level=3" --header "Range: bytes=$(($(header content-length) / 2))-"
  expect 206
  half=$(metric tweend_faces_computed_total)
  ((half > 768 + 180 && half < 768 + 200)) || { echo "$half"; false; }
  upload "$samples/tank.json"
  nodes=$(value '.nodes | length')
  counts tweend_joint_times_computed_total 0
  get "/v1/models/$id/pose.json?at=0,1,2"
  counts tweend_joint_times_computed_total $((3 * nodes))
  get "/v1/models/$id/pose.bin?from=0&to=4&fps=250"
  counts tweend_joint_times_computed_total $((1004 * nodes))
}

@test "the store's operations count, with their errors, and its bytes" {
  start_daemon --store-limit 1KiB
  counts tweend_store_limit_bytes 1024
  counts tweend_store_bytes 0
  upload "$samples/cube.obj"
  counts tweend_store_bytes "$(stat -c %s "$samples/cube.obj")"
  counts 'tweend_store_operations_total{operation="put"}' 1
  post /v1/models "$samples/octopus.obj"
  expect 507
  counts 'tweend_store_errors_total{operation="put"}' 1
  refused store_full 1
  get /v1/models
  counts 'tweend_store_operations_total{operation="list"}' 1
  http DELETE "/v1/models/$id"
  counts 'tweend_store_operations_total{operation="remove"}' 1
  counts 'tweend_store_errors_total{operation="remove"}' 0
  counts tweend_store_bytes 0
  [[ $(metric 'tweend_store_seconds_total{operation="put"}') =~ [1-9] ]]
  rm -rf "$data"
  get /v1/models
  expect 503
  counts 'tweend_store_errors_total{operation="list"}' 1
  refused store 1
}

@test "refusals count by reason: keys, rates, bodies, malformed heads" {
  printf 'all\nwriter write\nslow read 1/h\n' >keys
  start_daemon --api-keys "@$PWD/keys" --max-upload 1KiB --admin-listen 127.0.0.1:0
  as=(--header 'Authorization: Bearer all')
  get /v1/models
  get /v1/models --header 'Authorization: Bearer wrong'
  get /v1/models --header 'Authorization: Bearer writer'
  refused access 3
  get /v1/models --header 'Authorization: Bearer slow'
  expect 200
  get /v1/models --header 'Authorization: Bearer slow'
  expect 429
  refused key_rate 1
  refused rate 0
  post /v1/models "$samples/octopus.obj" "${as[@]}"
  expect 413
  refused body 1
  get /version --header 'Content-Length: 5' --header 'Transfer-Encoding: chunked'
  expect 400
  refused framing 1
  get /nothing "${as[@]}"
  expect 404
  total=$(curl --silent "${as[@]}" "$url/metrics" | awk '/^tweend_refusals_total/ { n += $2 } END { print n }')
  [ "$total" = 6 ] # what is not there is not refused
}

# start_watched [FLAG...]: a daemon whose metrics are asked for at a listener that nothing limits; $url is theirs,
# $served that of --listen.
start_watched() {
  start_daemon --admin-listen 127.0.0.1:0 "$@"
  served=$url url=$(admin_url)
}

ask() { curl --silent --output /dev/null --write-out '%{http_code}' "$served$1" "${@:2}"; }

@test "refusals count by reason: rates and connections of an address, listeners" {
  start_watched --rate-limit 2/h --max-connections-per-address 2 --max-listeners 0
  id=$(curl --silent --data-binary "@$samples/tank.json" "$served/v1/models" | gojq -r .id)
  [ "$(ask "/v1/models/$id/live")" = 503 ]
  refused listeners 1
  [ "$(ask /v1/models)" = 429 ]
  refused rate 1
  address=${served#http://}
  place=/dev/tcp/${address%:*}/${address#*:}
  counts tweend_http_connections 1 # those before are closed: it is the one that asks
  exec {one}<>"$place" {two}<>"$place"
  counts tweend_http_connections 3 # several threads accept, in no order
  exec {three}<>"$place"
  read -r line <&"$three"
  [[ $line == *503* ]]
  refused address_connections 1
  counts 'tweend_memory_bytes{kind="connection"}' $((3 * 32768)) # and the one that asks
  exec {one}>&- {two}>&- {three}>&-
}

# bats test_tags=plain
@test "refusals count by reason: slow requests, computing, answers cut off" {
  start_watched --header-timeout 300ms
  address=${served#http://}
  exec {slow}<>"/dev/tcp/${address%:*}/${address#*:}"
  printf 'GET / HTTP/1.1\r\n' >&"$slow"
  read -r line <&"$slow"
  exec {slow}>&-
  [[ $line == *408* ]]
  refused slow 1
  stop_daemon
  start_watched --compute-timeout 1ms
  [ "$(ask "/v1/surface.glb?level=6" --data-binary "@$samples/octopus.obj")" = 503 ]
  refused compute_timeout 1
  counts tweend_http_aborted_total 0
  stop_daemon
  start_watched --compute-timeout 500ms # is enough to begin the answer, on a busy machine too
  id=$(curl --silent --data-binary "@$samples/cube.obj" "$served/v1/models" | gojq -r .id)
  ask "/v1/models/$id/surface.obj?level=10" || true
  counts tweend_http_aborted_total 1
}

# bats test_tags=plain
@test "the queue, its threads and its refusals count" {
  start_watched --threads 1 --io-threads 3 --queue 0
  counts tweend_compute_threads 1
  counts tweend_io_threads 3
  counts tweend_queue_capacity 0
  counts tweend_compute_threads_busy 0
  grid 700 >large.obj
  curl --silent --output /dev/null --data-binary @large.obj "$served/v1/surface.glb?level=2" 3>&- &
  counts tweend_compute_threads_busy 1
  [ "$(ask "/v1/surface.glb" --data-binary "@$samples/cube.obj")" = 503 ]
  refused queue 1
  wait $!
  counts tweend_jobs_waiting 0
}

@test "requests that come during the drain are refused and counted" {
  start_watched
  id=$(curl --silent --data-binary "@$samples/octopus.obj" "$served/v1/models" | gojq -r .id)
  curl --silent --limit-rate 1M --output /dev/null "$served/v1/models/$id/surface.glb?level=6" 3>&- &
  counts tweend_http_requests_in_flight 2
  refused drain 0
  kill -TERM "$daemon"
  for ((tries = 0; tries < 100; tries++)); do
    [ "$(ask /v1/models)" != 503 ] || break
    pause 0.02
  done
  refused drain 1
  kill $! # it would take a minute
  wait $! || true
}
