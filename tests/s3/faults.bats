# A bucket that refuses, fails, hangs, breaks off, or comes back: what clients, probes, metrics and the log see.
#
# Started by `tests/s3/gateway run`.

# shellcheck disable=SC2154 # the helper sets them
load ../e2e/helper
gateway() { "$root/tests/s3/gateway" "$1" 3>&-; } # bats waits for whoever has 3 open
setup() {
  cd "$BATS_TEST_TMPDIR" || return
  proxy=""
}
teardown() {
  gateway thaw
  curl --silent --output /dev/null "$TWEEND_S3_ENDPOINT" || gateway again
  stop_daemon
  [ -z "$proxy" ] || kill "$proxy"
}

# through_proxy: a daemon whose store fails as the file faults tells.
through_proxy() {
  start_proxy
  start_daemon --s3-endpoint "http://127.0.0.1:$(cat port)"
  : >faults.log
}

# start_proxy [CERTIFICATE KEY]: by https with a certificate.
start_proxy() {
  node "$root/tests/s3/proxy.mjs" "$TWEEND_S3_ENDPOINT" "$PWD/faults" "$@" >port 3>&- &
  proxy=$!
  for _ in $(seq 100); do
    [ ! -s port ] || break
    sleep 0.1
  done
}

# another N: a model of its own.
another() { { cat "$samples/octopus.obj"; echo "# $1"; } >"model-$1.obj"; }

# refused_at_start PATTERN FLAG...: one line that tells why, by the daemon and by --check.
refused_at_start() {
  local check
  for check in --check=false --check; do
    # shellcheck disable=SC2086 # the runner may have arguments
    run timeout 20 ${TESTED_RUNNER-} "${TESTED_BINARY:-$root/build/tweend}" --listen 127.0.0.1:0 --data "$TESTED_DATA/x" \
      --cache-dir "$PWD/cache" "$check" "${@:2}"
    echo "$output"
    [ "$status" = 1 ]
    [ "${#lines[@]}" = 1 ]
    [[ $output =~ $1 ]]
  done
}

# unavailable: a 503 that says when to come again.
unavailable() {
  problem 503 "the store cannot be reached"
  [ "$(header retry-after)" -ge 1 ]
}

# gauge NAME VALUE
gauge() {
  get /metrics
  grep -qx "tweend_$1 $2" answer || { grep "^tweend_$1" answer; return 1; }
}

# recovers: the store is used again within some seconds.
recovers() {
  for _ in $(seq 150); do
    get /v1/models
    [ "$status" != 200 ] || break
    sleep 0.2
  done
  expect 200
  gauge store_up 1
  grep -q "can be reached again" log
}

# recovers_quietly: a refusal needs no recovery, and leaves no line.
recovers_quietly() {
  for _ in $(seq 50); do
    get /v1/models
    [ "$status" != 200 ] || return 0
    sleep 0.2
  done
  expect 200
}

# outage: what is cached goes on, in memory and on disk; the rest is 503, after some seconds and then at once; probes
# and metrics say so. The model $id is cached, $cold is stored and not cached here.
outage() {
  local tail
  for tail in "" /source /surface.json /pose; do
    get "/v1/models/$id$tail"
    expect 200
  done
  get "/v1/models/$cold/source" --max-time 25
  unavailable
  for _ in 1 2 3; do
    get "/v1/models/$cold" --max-time 2
    unavailable
    http POST /v1/models --data-binary "@$samples/cube.obj" --max-time 2
    unavailable
    http DELETE "/v1/models/$id" --max-time 2
    unavailable
    get /v1/models --max-time 2
    unavailable
    get "/v1/models/$id/source" --max-time 2
    expect 200
    cmp answer "$samples/tank.json"
    get "/v1/models/$id/surface.glb" --max-time 2
    expect 200
    get /readyz --max-time 2
    expect 200
  done
  gauge store_up 0
  [ "$(grep -c "cannot be used" log)" -ge 1 ]
  [ "$(grep -c "cannot be used" log)" -le 3 ]
}

# stored_and_cold: $id is a model that this daemon has served, $cold one that lies in the bucket alone.
stored_and_cold() {
  another cold
  upload model-cold.obj
  cold=$id
  rm -rf cache/objects cache/summaries
  upload "$samples/tank.json"
  stop_daemon
  start_daemon
  for tail in "" /source /surface.json /pose /surface.glb; do
    get "/v1/models/$id$tail"
    expect 200
  done
}

@test "a bucket that refuses ends the start with one line" {
  AWS_SECRET_ACCESS_KEY=wrong refused_at_start '403, SignatureDoesNotMatch'
  AWS_ACCESS_KEY_ID=nobody refused_at_start '403, InvalidAccessKeyId'
  TESTED_DATA=s3://no-such-bucket refused_at_start '404, NoSuchBucket'
  TESTED_DATA=s3:// refused_at_start 's3://BUCKET'
  TESTED_DATA='s3://tweend/a b' refused_at_start 'prefix'
  refused_at_start 's3-endpoint' --s3-endpoint ftp://127.0.0.1
  refused_at_start 'no-such-file' --s3-credentials "$PWD/no-such-file"
  AWS_ACCESS_KEY_ID='' HOME=$PWD refused_at_start 'no credentials'
}

@test "credentials come from files too, and are read again when they are replaced" {
  key=$AWS_ACCESS_KEY_ID secret=$AWS_SECRET_ACCESS_KEY
  unset AWS_ACCESS_KEY_ID AWS_SECRET_ACCESS_KEY
  printf '[default]\naws_access_key_id = nobody\naws_secret_access_key = nothing\n# a comment\n[work]\n aws_access_key_id=%s\r\naws_secret_access_key = %s \n' \
    "$key" "$secret" >credentials
  AWS_SHARED_CREDENTIALS_FILE=$PWD/credentials AWS_PROFILE=work start_daemon
  upload "$samples/cube.obj"
  stop_daemon
  mkdir .aws
  sed 's/work/default/; 1,3d' credentials >.aws/credentials
  HOME=$PWD start_daemon
  get "/v1/models/$id/source"
  expect 200
  stop_daemon
  printf 'aws_access_key_id=%s\naws_secret_access_key=%s\n' "$key" "$secret" >secret
  start_daemon --s3-credentials "$PWD/secret"
  sed 's/^aws_secret.*/&x/' secret >wrong
  cp secret right
  mv wrong secret
  post /v1/models "$samples/octopus.obj"
  unavailable
  grep -q 'refuses: status 403' log
  get /readyz
  expect 200
  mv right secret
  upload "$samples/octopus.obj"
}

@test "the bucket's name stands in the path or before the host's" {
  start_proxy
  start_daemon --s3-endpoint "http://localhost:$(cat port)" --s3-style virtual
  upload "$samples/tank.json"
  get /v1/models
  holds '.models | length == 1'
  run ! grep ' /tweend/' faults.log
  stop_daemon
  rm -rf cache faults.log
  start_daemon --s3-endpoint "http://localhost:$(cat port)"
  get "/v1/models/$id/source"
  expect 200
  cmp answer "$samples/tank.json"
  run ! grep -v ' /tweend[/?]' faults.log
}

@test "an https endpoint is used with the certificates of AWS_CA_BUNDLE, and with no others" {
  openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=store \
    -addext subjectAltName=IP:127.0.0.1 -keyout key -out certificate 2>/dev/null
  start_proxy certificate key
  AWS_CA_BUNDLE=$PWD/certificate start_daemon --s3-endpoint "https://127.0.0.1:$(cat port)"
  recovers_quietly # a busy machine shakes hands for longer than a daemon that starts waits
  upload "$samples/tank.json"
  get "/v1/models/$id/source"
  expect 200
  stop_daemon
  start_daemon --s3-endpoint "https://127.0.0.1:$(cat port)"
  get /readyz
  problem 503
  post /v1/models "$samples/tank.json"
  unavailable
  grep -q 'cannot be used: .*certificate' log
}

@test "a gateway that is killed: what is cached is served, and the store is used again when it is back" {
  start_daemon
  stored_and_cold
  gateway kill
  outage
  gateway again
  recovers
  get "/v1/models/$cold/source"
  expect 200
}

@test "a store that hangs holds nobody for long" {
  start_daemon
  stored_and_cold
  gateway freeze
  outage
  gateway thaw
  recovers
  upload "$samples/cube.obj"
}

@test "a daemon that starts without its store is ready once it has reached it" {
  gateway kill
  start_daemon
  get /readyz
  problem 503
  get /healthz
  expect 200
  gateway again
  recovers
  get /readyz
  expect 200
  upload "$samples/cube.obj"
}

@test "faults that pass are tried again" {
  through_proxy
  n=0
  for fault in '429 SlowDown' '500 InternalError' '502' '503 SlowDown' '504' reset; do
    for method in HEAD GET PUT; do
      n=$((n + 1))
      another $n
      rm -rf cache/objects
      if [[ $method == GET ]]; then
        upload model-$n.obj
        rm -rf cache/objects
        stop_daemon
        start_daemon --s3-endpoint "http://127.0.0.1:$(cat port)"
        echo "$method:$fault" >faults
        get "/v1/models/$id/source"
        expect 200
        cmp answer model-$n.obj
      else
        echo "$method:$fault" >faults
        upload model-$n.obj
      fi
      [ ! -s faults ]
    done
  done
  run ! grep "cannot be used" log
}

@test "faults that stay are 503 with Retry-After, and leave the daemon ready" {
  through_proxy
  upload "$samples/tank.json"
  another 1
  for fault in '403 AccessDenied' '429 SlowDown' '500 InternalError' '503 SlowDown' reset; do
    echo "always $fault" >faults
    post /v1/models model-1.obj
    unavailable
    get /v1/models
    unavailable
    get "/v1/models/$id/source"
    expect 200
    get /readyz
    expect 200
    [[ $fault == reset ]] || grep -q "status ${fault%% *}" log
    : >faults
    recovers_quietly
  done
  post /v1/models model-1.obj
  expect 201
}

@test "a full bucket is 507" {
  through_proxy
  echo 'PUT:403 QuotaExceeded' >faults
  post /v1/models "$samples/cube.obj"
  problem 507
  upload "$samples/cube.obj"
}

@test "a start asks the bucket once, however many models there are" {
  start_daemon
  for n in 1 2 3; do
    another "$n"
    upload "model-$n.obj"
  done
  stop_daemon
  start_proxy
  start_daemon --s3-endpoint "http://127.0.0.1:$(cat port)"
  [ "$(grep -c list-type faults.log)" = 1 ]
}

@test "a page of a listing without a body is a fault, not the page before again" {
  through_proxy
  upload "$samples/cube.obj"
  s3 PUT objects/00/foreign --data-binary x # so that the model ends the first page of two keys
  s3 PUT objects/ff/foreign --data-binary x
  get '/v1/models?limit=1'
  holds '(.models | length == 1) and .next == null'
  printf 'GET:slow 1000000\nGET:200 empty\n' >faults
  get '/v1/models?limit=1'
  unavailable
  [ ! -s faults ]
  recovers
}

@test "a store without ETags: what is damaged is noticed, and so is what became whole" {
  through_proxy
  echo 'always untagged' >faults
  upload "$samples/tank.json"
  sed 's/hull/hall/' "$samples/tank.json" >damaged
  s3 PUT "objects/${id:0:2}/$id" --data-binary @damaged
  sleep 1.1 # a look of the last second counts
  for tail in "" /source; do
    get "/v1/models/$id$tail"
    problem 500 "the stored bytes are damaged"
  done
  s3 PUT "objects/${id:0:2}/$id" --data-binary "@$samples/tank.json"
  get "/v1/models/$id/source"
  expect 200
  cmp answer "$samples/tank.json"
}

@test "a model that this machine has no room for is no outage" {
  start_daemon
  { cat "$samples/octopus.obj"; yes '# more than memory holds of an object on its way' | head -n 40000; } >long.obj
  upload long.obj
  long=$id
  stop_daemon
  rm -r cache
  ulimit -S -f 1200 # KiB of a file
  start_daemon
  get "/v1/models/$long/source"
  unavailable
  run ! grep "cannot be used" log
  grep -q "no room in --cache-dir for model $long" log
  gauge store_up 1
}

@test "a store that knows no conditional PUT gets plain ones" {
  through_proxy
  echo 'PUT:501 NotImplemented' >faults
  post /v1/models "$samples/cube.obj"
  expect 201
  post /v1/models "$samples/cube.obj"
  expect 200
  another 1
  upload model-1.obj
  [ "$(grep -c ^PUT faults.log)" = 3 ]
}

@test "a download that breaks off goes on where it broke, and a slow one arrives" {
  through_proxy
  { cat "$samples/cube.obj"; head -c 3000000 /dev/urandom | base64 | sed 's/^/# /'; } >large.obj
  upload large.obj
  stop_daemon
  rm -rf cache
  start_daemon --s3-endpoint "http://127.0.0.1:$(cat port)"
  printf 'GET:cut 1000000\nGET:cut 2000000\nGET:reset\n' >faults
  get "/v1/models/$id/source"
  expect 200
  cmp answer large.obj
  [ ! -s faults ]
  grep -q 'bytes=1000000-$' faults.log
  [ "$(grep -c 'bytes=3000000-$' faults.log)" = 2 ]
  stop_daemon
  rm -rf cache
  start_daemon --s3-endpoint "http://127.0.0.1:$(cat port)" --s3-timeout 30s
  echo 'GET:slow 600000' >faults # longer than the limit for standing still
  get "/v1/models/$id/source"
  expect 200
  cmp answer large.obj
  stop_daemon
  rm -rf cache
  start_daemon --s3-endpoint "http://127.0.0.1:$(cat port)" --s3-timeout 2s
  echo 'GET:slow 600000' >faults
  get "/v1/models/$id/source"
  unavailable
}

@test "copies stay within --cache-size, are made good when they are damaged, and may vanish" {
  start_daemon --cache-size 1MiB
  ids=()
  for n in $(seq 60); do
    another "$n"
    head -c 20000 /dev/zero | tr '\0' '\n' >>"model-$n.obj"
    upload "model-$n.obj"
    ids+=("$id")
  done
  [ "$(du --summarize --block-size=1 cache/objects | cut -f 1)" -le $((1048576 + 256 * 4096 * 2)) ]
  find cache/objects -type f -printf '%b\n' | awk '{ blocks += $1 } END { exit !(blocks > 0 && blocks * 512 <= 1048576) }'
  get /metrics
  awk '$1 == "tweend_store_cache_bytes" { found = 1; exit !($2 <= 1048576) } END { exit !found }' answer
  # The first ones went, and come again from the bucket.
  [ ! -e "cache/objects/${ids[0]:0:2}/${ids[0]}" ]
  stop_daemon
  start_daemon --cache-size 1MiB
  for n in 1 60; do
    get "/v1/models/${ids[n - 1]}/source"
    expect 200
    cmp answer "model-$n.obj"
  done
  echo damage >"cache/objects/${id:0:2}/$id"
  get "/v1/models/$id/source"
  expect 200
  cmp answer model-60.obj
  cmp "cache/objects/${id:0:2}/$id" model-60.obj
  rm -rf cache/objects cache/summaries
  get "/v1/models/$id/source"
  cmp answer model-60.obj
  stop_daemon
  start_daemon --cache-size 0
  get "/v1/models/$id/source"
  cmp answer model-60.obj
  get "/v1/models/$id"
  expect 200
}
