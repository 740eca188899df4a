# What holds of models wherever they are stored: in a folder, or with TESTED_DATA in a bucket.

load helper
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
  first=""
  start_daemon
}
teardown() {
  stop_daemon
  daemon=$first stop_daemon
}

# start_second: another daemon on the same models; the first one is at $first_url from then on.
start_second() {
  first=$daemon first_url=$url
  start_daemon --cache-dir "$PWD/second"
}

# overwrite ID FILE: changes what is stored, behind the daemon's back.
overwrite() {
  if [[ -n ${TESTED_DATA-} ]]; then
    s3 PUT "objects/${1:0:2}/$1" --data-binary "@$2" --header 'Content-Type: application/octet-stream'
  else
    cat "$2" >"$data/objects/${1:0:2}/$1"
  fi
}

# stock COUNT: as many names of models, without their bytes, and ids in order in the file ids.
stock() {
  python3 - "$1" "${TESTED_DATA:+$TWEEND_S3_ENDPOINT/${data#s3://}}" "$data" <<'STOCK'
import hashlib, os, sys
count, url, folder = int(sys.argv[1]), sys.argv[2], sys.argv[3]
ids = sorted(hashlib.md5(str(n).encode()).hexdigest() for n in range(count))
open('ids', 'w').writelines(f'{id}\n' for id in ids)
if url:
    user = f'{os.environ["AWS_ACCESS_KEY_ID"]}:{os.environ["AWS_SECRET_ACCESS_KEY"]}'
    summary = '%7B%22name%22%3A%22stocked%22%2C%22format%22%3A%22obj%22%7D'
    open('requests', 'w').write('next\n'.join(
        f'url = "{url}/objects/{id[:2]}/{id}"\nrequest = PUT\ndata = x\nfail\noutput = /dev/null\n'
        f'aws-sigv4 = "aws:amz:us-east-1:s3"\nuser = "{user}"\nheader = "x-amz-content-sha256: UNSIGNED-PAYLOAD"\n'
        f'header = "Content-Type: text/plain"\nheader = "x-amz-meta-summary: {summary}"\n' for id in ids))
else:
    for id in ids:
        for place, name, text in ('objects', id, 'x'), ('summaries', id[2:], '{"name":"stocked","format":"obj"}'):
            os.makedirs(f'{folder}/{place}/{id[:2]}', exist_ok=True)
            open(f'{folder}/{place}/{id[:2]}/{name}', 'w').write(text)
STOCK
  [[ ! -e requests ]] || curl --silent --parallel --parallel-max 64 --config requests
}

@test "a model is stored once, read, described, listed and deleted" {
  post '/v1/models?name=Gr%C3%B6%C3%9Fe%20%E2%9C%93%20%22%25%22' "$samples/tank.json"
  expect 201
  id=$(value .id)
  post /v1/models?name=other "$samples/tank.json"
  expect 200
  holds '.name == "Größe ✓ \"%\""'
  upload "$samples/cube.obj"
  cube=$id
  id=$(sha256sum "$samples/tank.json" | head -c 32)
  get "/v1/models/$id/source"
  expect 200
  cmp answer "$samples/tank.json"
  get "/v1/models/$id/source" --range 100-199
  expect 206
  cmp answer <(tail -c +101 "$samples/tank.json" | head -c 100)
  get "/v1/models/$id"
  holds '.name == "Größe ✓ \"%\"" and .bytes == '"$(stat -c %s "$samples/tank.json")"
  get /v1/models
  holds "[.models[].id] == ([\"$id\", \"$cube\"] | sort)"
  holds ".models[] | select(.id == \"$id\") | .name == \"Größe ✓ \\\"%\\\"\" and .format == \"tweend\""
  http DELETE "/v1/models/$id"
  expect 204
  http DELETE "/v1/models/$id"
  problem 404
  get "/v1/models/$id/source"
  problem 404
  get /v1/models
  holds "[.models[].id] == [\"$cube\"]"
  post /v1/models "$samples/tank.json"
  expect 201
}

@test "models outlive the daemon and its cache" {
  upload "$samples/octopus.obj"
  get "/v1/models/$id"
  cp answer before
  stop_daemon
  rm -rf cache
  start_daemon
  get "/v1/models/$id"
  expect 200
  diff <(gojq . before) <(gojq . answer)
  get "/v1/models/$id/source"
  cmp answer "$samples/octopus.obj"
  post /v1/models "$samples/octopus.obj"
  expect 200
}

@test "of twenty uploads of the same bytes that race through two daemons one stores them" {
  start_second
  for round in 1 2 3; do
    { cat "$samples/octopus.obj"; echo "# $round"; } >model.obj
    clients=()
    for i in $(seq 20); do
      [ $((i % 2)) = 0 ] && to=$url || to=$first_url
      curl --silent --output /dev/null --write-out '%{http_code}\n' --data-binary @model.obj "$to/v1/models" 3>&- >"code-$i" &
      clients+=($!)
    done
    wait "${clients[@]}"
    [ "$(cat code-* | grep -cx 201)" = 1 ]
    [ "$(cat code-* | grep -cx 200)" = 19 ]
  done
  get /v1/models
  holds '.models | length == 3'
}

@test "what one daemon stores another one has, and what one deletes the other forgets within two seconds" {
  start_second
  second_url=$url
  for from in "$first_url" "$second_url"; do
    { cat "$samples/octopus.obj"; echo "# $from"; } >model.obj
    url=$from
    upload model.obj
    for url in "$first_url" "$second_url"; do
      for tail in "" /source /surface.json /surface.json; do
        get "/v1/models/$id$tail"
        expect 200
      done
    done
    url=$from
    http DELETE "/v1/models/$id"
    expect 204
    sleep 2
    for url in "$first_url" "$second_url"; do
      for tail in "" /source /surface.json; do
        get "/v1/models/$id$tail"
        problem 404
      done
    done
  done
}

@test "bytes changed behind the daemon's back are 500 until they are uploaded again" {
  upload "$samples/tank.json"
  for changed in 's/hull/hall/' '1d' '$d'; do
    sed "$changed" "$samples/tank.json" >damaged
    ! cmp --silent damaged "$samples/tank.json"
    get "/v1/models/$id/pose"
    expect 200
    overwrite "$id" damaged
    sleep 1.1 # a look of the last second counts
    start_second
    for daemons in "$first_url" "$url"; do
      url=$daemons
      for tail in "" /source /surface.glb /pose /tracks; do
        get "/v1/models/$id$tail"
        problem 500 "the stored bytes are damaged; upload them again"
      done
    done
    get '/v1/models?limit=10'
    expect 200
    post /v1/models "$samples/tank.json"
    expect 201
    for url in "$first_url" "$url"; do
      get "/v1/models/$id/source"
      cmp answer "$samples/tank.json"
      get "/v1/models/$id/pose?at=1"
      expect 200
    done
    post /v1/models "$samples/tank.json"
    expect 200
    stop_daemon
    daemon=$first url=$first_url first=""
  done
}

@test "thousands of models are listed by pages, each once and in order" {
  stock 3000
  : >seen
  next='/v1/models?limit=300'
  for page in 1 2 3 4 5 6 7 8 9 10; do
    get "$next"
    expect 200
    holds '.models | length == 300 and all(.name == "stocked" and .format == "obj")'
    value '.models[].id' >>seen
    next=$(value .next)
  done
  [ "$next" = null ]
  cmp seen ids
  get "/v1/models?limit=3&after=$(sed -n 1321p ids)"
  cmp <(value '.models[].id') <(sed -n 1322,1324p ids)
  get "/v1/models?after=ffffffffffffffffffffffffffffffff"
  holds '.models == [] and .next == null'
}
