# Keys with rights and rates, signed URLs, and what pages of other origins may do.

load helper

setup() { cd "$BATS_TEST_TMPDIR" || return; }
teardown() { stop_daemon; }

as() { printf 'Authorization: Bearer %s' "$1"; }

# signature METHOD PATH QUERY KEY: of the contract's form, by openssl.
signature() {
  printf '%s\n%s\n%s' "$1" "$2" "$3" | openssl dgst -sha256 -hmac "$4" -binary | base64 -w 0 | tr '+/' '-_' | tr -d =
}

start_with_rights() {
  needs_process
  cat >keys <<'END'
# who may what
all
reader read
writer write
remover delete
slow read 3/m
END
  printf 'rose\nold\n' >url-keys
  start_daemon --api-keys "@$PWD/keys" --url-keys "@$PWD/url-keys"
}

@test "a key does what it has the right to, and nothing else" {
  start_with_rights
  post /v1/models "$samples/cube.obj" --header "$(as reader)"
  problem 403 write
  post /v1/models "$samples/cube.obj" --header "$(as writer)"
  expect 201
  [[ $(header cache-control) == private* ]]
  id=$(gojq -r .id answer)
  get "/v1/models/$id/surface.glb" --header "$(as writer)"
  problem 403 read
  get "/v1/models/$id/surface.glb" --header "X-API-Key: reader"
  expect 200
  [[ $(header cache-control) == private,* && $(header vary) == *Authorization* ]]
  get /metrics
  problem 401
  get /metrics --header "$(as reader)"
  expect 200
  http DELETE "/v1/models/$id" --header "$(as reader)"
  problem 403 delete
  http DELETE "/v1/models/$id" --header "$(as remover)"
  expect 204
  for open in /healthz /readyz /version /openapi.json; do
    get "$open"
    expect 200
    [[ $(header cache-control) != private* ]]
  done
}

@test "a signed URL is read without a key until its time is over" {
  start_with_rights
  post /v1/models "$samples/tank.json" --header "$(as all)"
  id=$(gojq -r .id answer)
  path=/v1/models/$id/pose.json
  exp=$(($(date +%s) + 600))
  for key in rose old; do
    sig=$(signature GET "$path" "at=0.5%2C1&clip=drive&exp=$exp&nodes=barrel" "$key")
    get "$path?clip=drive&nodes=barrel&at=0.5,1&exp=$exp&sig=$sig"
    expect 200
    http HEAD "$path?clip=drive&nodes=barrel&at=0.5,1&exp=$exp&sig=$sig"
    expect 200
    get "$path?clip=drive&nodes=barrel&at=0.5,2&exp=$exp&sig=$sig"
    problem 403 signature
    get "$path?clip=drive&nodes=barrel&at=0.5,1&exp=$((exp + 1))&sig=$sig"
    problem 403 signature
  done
  past=$(($(date +%s) - 1))
  get "$path?exp=$past&sig=$(signature GET "$path" "exp=$past" rose)"
  problem 403 over
  http DELETE "/v1/models/$id?exp=$exp&sig=$(signature DELETE "/v1/models/$id" "exp=$exp" rose)"
  problem 401
}

@test "the daemon signs URLs for whoever may read" {
  start_with_rights
  order='{"url": "/v1/models?limit=1", "seconds": 60}'
  post /v1/sign <(printf %s "$order")
  problem 401
  post /v1/sign <(printf %s "$order") --header "$(as writer)"
  problem 403
  post /v1/sign <(printf %s "$order") --header "$(as reader)"
  expect 200
  signed=$(value .url)
  [[ $signed == "/v1/models?limit=1&exp="*"&sig="* ]]
  get "$signed"
  expect 200
  get "${signed/limit=1/limit=2}"
  problem 403
  post /v1/sign <(printf '{"url": "/v1/models", "seconds": 604801}') --header "$(as reader)"
  problem 422 'seven days'
}

@test "SIGHUP takes over other rights and other keys for URLs" {
  start_with_rights
  exp=$(($(date +%s) + 600))
  signed="/v1/models?exp=$exp&sig=$(signature GET /v1/models "exp=$exp" old)"
  get "$signed"
  expect 200
  echo rose >url-keys
  echo 'reader write' >keys
  kill -HUP "$daemon"
  for ((tries = 0; tries < 100; tries++)); do
    get "$signed"
    [[ $status == 200 ]] || break
    pause 0.1
  done
  problem 403
  get /v1/models --header "$(as reader)"
  problem 403 read
  echo 'reader reed' >keys
  kill -HUP "$daemon"
  for ((tries = 0; tries < 100; tries++)); do
    ! grep -q 'line 1 is not KEY' "$log" || break
    pause 0.1
  done
  grep -q 'the API keys stay' "$log"
}

@test "a key over its rate is 429 with the time to come back" {
  start_with_rights
  for left in 2 1 0; do
    get /v1/models --header "$(as slow)"
    expect 200
    [[ $(header ratelimit-policy) == '"key";q=3;w=60' && $(header ratelimit) == "\"key\";r=$left;t="* ]]
  done
  get /v1/models --header "$(as slow)"
  problem 429
  (($(header retry-after) >= 1 && $(header retry-after) <= 20))
  get /v1/models --header "$(as reader)"
  expect 200
  [[ -z $(header ratelimit) ]]
  get /healthz --header "$(as slow)"
  expect 200
}

# start_everywhere [FLAG...]: on an address that is not loopback, asked over loopback.
start_everywhere() {
  start_daemon --listen 0.0.0.0:0 "$@"
  url=${url/0.0.0.0/127.0.0.1}
}

@test "pages of other origins neither list nor delete, unless they are named" {
  needs_process
  start_everywhere
  far='Origin: https://far.example'
  post /v1/models "$samples/cube.obj" --header "$far"
  expect 201
  [[ $(header access-control-allow-origin) == '*' && $(header timing-allow-origin) == '*' ]]
  id=$(gojq -r .id answer)
  get "/v1/models/$id" --header "$far"
  expect 200
  [[ $(header access-control-allow-origin) == '*' ]]
  get /v1/models --header "$far"
  problem 403
  [[ $(header access-control-allow-origin) == '*' ]] # so that the page can read why
  http DELETE "/v1/models/$id" --header "$far"
  problem 403
  http OPTIONS "/v1/models/$id" --header "$far" --header 'Access-Control-Request-Method: DELETE'
  expect 204
  [[ $(header access-control-allow-methods) == *DELETE* ]] # the page may ask, and reads the refusal
  get /v1/models --header "Origin: $url"
  expect 200
  stop_daemon
  start_daemon --cors-origins https://far.example
  get /v1/models --header "$far"
  expect 200
  [[ $(header access-control-allow-origin) == https://far.example ]]
  http DELETE "/v1/models/$id" --header "$far"
  expect 204
}

@test "a page elsewhere stores nothing in a daemon on a loopback address" {
  needs_process
  start_daemon
  upload "$samples/cube.obj"
  edit='{"edits": [{"edit": "move", "vertices": "all", "by": [1, 0, 0]}]}'
  for far in 'Origin: https://far.example' 'Origin: null' 'Sec-Fetch-Site: cross-site'; do
    curl --silent --output answer --dump-header headers --header "$far" --form "file=@$samples/tank.json" "$url/v1/models"
    grep -q '^HTTP/1.1 403' headers
    post /v1/models "$samples/tank.json" --header "$far"
    problem 403 origin
    [[ $(header access-control-allow-origin) == '*' ]]
    post "/v1/models/$id/edits" <(printf %s "$edit") --header "$far"
    problem 403 origin
    http POST "/v1/models/$id/coarsen" --header "$far"
    problem 403 origin
    post /v1/surface.json "$samples/cube.obj" --header "$far"
    expect 200
    get "/v1/models/$id/surface.json" --header "$far"
    expect 200
  done
  get /v1/models
  holds '.models | length == 1'
  get /metrics
  grep -q '^tweend_refusals_total{reason="access"} 12$' answer
  # Refused on the head: the body is never asked for.
  sent=$(curl --silent --output /dev/null --write-out '%{http_code} %{size_upload}' --header 'Expect: 100-continue' \
    --header 'Origin: null' --header 'Content-Type: model/obj' --data-binary "@$samples/cube.obj" "$url/v1/models")
  [ "$sent" = '403 0' ]
  for near in "$url" http://localhost:5173 https://app.localhost 'http://[::1]:1'; do
    post /v1/models "$samples/cube.obj" --header "Origin: $near"
    expect 200
  done
  stop_daemon
  start_daemon --cors-origins https://far.example
  post /v1/models "$samples/tank.json" --header 'Origin: https://far.example'
  expect 201
}

@test "a loopback address serves its own hosts and those of --hosts" {
  needs_process
  start_daemon --hosts 'tweend.example, b.example'
  for host in localhost localhost:1 127.0.0.1 '[::1]:8080' Tweend.Example b.example:443; do
    get /v1/models --header "Host: $host"
    expect 200
  done
  for host in evil.example evil.example:8080 localhost.evil.example 127.0.0.2; do
    for path in / /healthz /v1/models /nothing; do
      get "$path" --header "Host: $host"
      problem 421 --hosts
      [[ $(header access-control-allow-origin) == '*' ]]
    done
    post /v1/models "$samples/cube.obj" --header "Host: $host"
    problem 421
    http DELETE "/v1/models/00000000000000000000000000000000" --header "Host: $host"
    problem 421
  done
  # The host of an absolute target counts, not the field (RFC 9112, 3.2.2).
  get /version --request-target http://evil.example/version
  problem 421
  get /version --request-target http://localhost/version --header 'Host: evil.example'
  expect 200
  get /healthz --http1.0 --header Host:
  expect 200
  "${TESTED_BINARY:-$root/build/tweend}" --healthcheck --listen "${url#http://}"
  stop_daemon
  start_daemon --api-keys key
  get /v1/models --header 'Host: evil.example' --header 'X-API-Key: key'
  expect 200
  stop_daemon
  start_everywhere
  get /v1/models --header 'Host: evil.example'
  expect 200
  post /v1/models "$samples/cube.obj" --header 'Origin: https://far.example'
  expect 201
}

@test "a listener for probes on a loopback address serves its own hosts, also with keys" {
  needs_process
  start_everywhere --api-keys key --admin-listen 127.0.0.1:0
  admin=$(admin_url)
  [ "$(curl --silent --output /dev/null --write-out '%{http_code}' "$admin/metrics")" = 200 ]
  [ "$(curl --silent --output /dev/null --write-out '%{http_code}' --header 'Host: evil.example' "$admin/metrics")" = 421 ]
}

@test "a socket of systemd counts by the address it is bound to" {
  needs_process
  command -v systemd-socket-activate >/dev/null || skip "needs systemd-socket-activate"
  port=$(free_port)
  systemd-socket-activate --listen "127.0.0.1:$port" "${TESTED_BINARY:-$root/build/tweend}" --data "$PWD/data" \
    --listen 0.0.0.0:1 >out 2>log.txt 3>&- &
  daemon=$! log=$PWD/log.txt
  for ((tries = 0; tries < 100; tries++)); do
    code=$(curl --silent --output /dev/null --write-out '%{http_code}' --header 'Host: evil.example' "http://127.0.0.1:$port/version") && break
    pause 0.1
  done
  [ "$code" = 421 ]
}

@test "uploads that would leave less than --min-free are 507 before their bodies" {
  needs_process
  start_daemon --min-free 1000TiB
  sent=$(curl --silent --output answer --write-out '%{http_code} %{size_upload}' --header 'Expect: 100-continue' \
    --header 'Content-Type: model/obj' --data-binary "@$samples/cube.obj" "$url/v1/models")
  [ "$sent" = '507 0' ]
  holds '.detail | contains("--min-free")'
  post /v1/surface.json "$samples/cube.obj"
  expect 200
  stop_daemon
  start_daemon --min-free 0
  upload "$samples/cube.obj"
}
