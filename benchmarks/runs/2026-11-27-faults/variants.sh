#!/bin/bash
# A variant of each fault that was once found: variants.sh RIPRAP FAULT.SO PYTHON_WITH_H5PY   (FAULT.SO: solver_tests/faults/inject.c as a library)
# A line each: met or NOT MET, the kind, what was tried, what came of it. Works in a new folder.
set -u
B=$(realpath "$1") SO=$(realpath "$2") PY=$3
cd "$(mktemp -d)" || exit 1
met() { echo "met      | $1"; }
not() { echo "NOT MET  | $1"; }
is() { if [ "$1" = "$2" ]; then met "$3: $1"; else not "$3: $1, wanted $2"; fi; }
sha() { sha256sum "$@" | cut -c1-64 | sort -u | tr '\n' ' '; }
code() { timeout 60 "$@" > o 2> e; echo $?; }
hurt() { # TARGET OPERATION KIND [OPTIONS]: a run that is killed or fails at a file operation
    LD_PRELOAD=$SO FAULT_MATCH=x.h5 FAULT_AT=$2 FAULT_KIND=$3 FAULT_TIMES=${4:-1} "$B" run short.json --out "$1" --threads 1 --quiet > o 2> e
}
cat > short.json <<'J'
{"title":"short","scene":{"gravity":[0,0,-9.81],"bodies":[
 {"name":"plate","shape":{"box":[1,1,0.1]},"position":[0,0,-0.05],"fixed":true},
 {"name":"block","shape":{"box":[0.1,0.1,0.1]},"position":[0,0,0.05]}]},
 "rock":{"density":2700,"youngs_modulus":"30 GPa","poissons_ratio":0.2,"damage":null},"contact":{"friction":0.5},
 "stages":[{"kind":"load","increments":4,"bodies":{"block":{"displacement":["1 mm",0,null]}}},
           {"kind":"load","increments":3,"bodies":{"block":{"displacement":["0.5 mm",null,null],"force":[null,null,"-20 N"]}}}],
 "output":{"fields_every":0.3,"restart_every":1}}
J
sed 's/"short"/"other"/; s/0.5 mm/0.4 mm/' short.json > other.json
"$B" run short.json --out good.h5 --threads 1 --quiet
"$B" run other.json --out other.h5 --threads 1 --quiet
LD_PRELOAD=$SO FAULT_MATCH=x.h5 FAULT_LOG=ops "$B" run short.json --out x.h5 --threads 1 --quiet
N=$(wc -l < ops)
# A kill within a commit's writes: a torn file and its journal. How many commits a run has hangs on its time, so the last of them is looked for.
MARKS=$(grep -n 'fsync .*journal' ops | cut -d: -f1 | sort -rn)
tear() { # TARGET JOURNAL
    for mark in $MARKS; do
        rm -f "$2" "${2%.journal}"
        hurt "$1" $((mark + 4)) kill_half
        [ -e "$2" ] && return
    done
    not "no kill tore a file"
    exit 1
}
torn() { # its journal hidden under the name j
    rm -rf x.h5* j
    tear x.h5 x.h5.journal
    mv x.h5.journal j
}
torn 2> /dev/null
is "$(code "$B" info x.h5)" 4 "a torn file, its journal hidden"

# 1 a journal is one file's
mv j x.h5.journal
cp other.h5 x.h5; before=$(sha x.h5)
for c in "info x.h5" "export x.h5 --csv c" "report x.h5 --out r" "run other.json --out x.h5 --resume --quiet"; do code "$B" $c > rc; done
is "$(sha x.h5)" "$before" "stale journal: another case's file copied over a killed one, four commands"
# 2 found through links
rm -rf x.h5*; mkdir far; ln -s ../far/x.h5 far/a; ln -s far/a chain.h5
tear chain.h5 far/x.h5.journal 2> /dev/null
is "$(ls far/x.h5.journal) $(code "$B" info chain.h5 --verify) $(ls far | grep -c journal)" "far/x.h5.journal 0 0" "put back through a chain of two links"
is "$(code "$B" run short.json --out chain.h5 --resume --quiet)" 0 "resumed through a chain of two links"
# 3 moved without its journal, to another folder
torn 2> /dev/null; mkdir -p away; mv x.h5 away/t.h5; before=$(sha away/t.h5)
r1=$(cd away && code "$B" info t.h5); t1=$(cat away/e); r2=$(cd away && code "$B" run ../short.json --out t.h5 --resume)
is "$r1 $r2 $(grep -c 'killed within a commit.*t.h5.journal' <<< "$t1") $(sha away/t.h5)" "4 4 1 $before" "moved to another folder without its journal"
# 4 three names of one file
torn 2> /dev/null; cp j x.h5.journal; ln x.h5 y.h5; ln x.h5 z.h5
"$B" run short.json --out z.h5 --resume --quiet; before=$(sha x.h5 y.h5 z.h5)
for n in x y z; do cp j $n.h5.journal; code "$B" info $n.h5 > rc; done
is "$(sha x.h5 y.h5 z.h5)" "$before" "three hard names, the old journal beside each"
# 5 a disk that stays full from some operation on
lost=0 told=0
for at in $(seq 3 23 $((N - 5))); do
    rm -f x.h5*; hurt x.h5 "$at" enospc 1000000; r=$?
    # A run that is done before has exit 0, and is whole.
    case $r in 4) told=$((told + 1)) ;; 0) "$B" info x.h5 --verify > o || lost=$((lost + 1)) ;; *) lost=$((lost + 1)) ;; esac
    "$B" run short.json --out x.h5 --resume --quiet 2> e || lost=$((lost + 1))
done
is "$lost" 0 "disk full from operation 3, 26, ... on ($told told, all resumed)"
# 6 changed under the run
sed 's/"increments":4/"increments":4000/' short.json > long.json
"$B" run long.json --out long.h5 --threads 1 --quiet; "$B" export long.h5 --csv long > o
for how in larger emptied longer 20000 200000 700000 1200000 copied removed unwritable; do
    rm -rf run c; mkdir run; "$B" run long.json --out run/x.h5 --threads 1 --quiet > o 2> e & p=$!
    sleep 1.5
    case $how in
    larger) head -c 9000000 /dev/urandom > big; mv big run/x.h5; before=$(sha run/x.h5) ;;
    emptied) : > run/x.h5 ;;
    longer) head -c 5000 /dev/urandom >> run/x.h5 ;;
    copied) cp run/x.h5 run/y.h5; mv run/y.h5 run/x.h5 ;;
    removed) rm run/x.h5 ;;
    unwritable) rm -rf run ;;
    *) head -c 5000 /dev/urandom | dd of=run/x.h5 bs=1 seek="$how" conv=notrunc 2> e; how="written to at $how" ;;
    esac
    wait $p; r=$?
    [ "$how" = larger ] && [ "$(sha run/x.h5)" != "$before" ] && r="$r and touched"
    # What is written where nothing lies, or where the run writes later, does no harm.
    if [ "$r" = 0 ]; then
        v=$(code "$B" info run/x.h5 --verify); code "$B" export run/x.h5 --csv c > rc
        "$PY" -c "
import csv,sys
a,b=[[{k:v for k,v in row.items() if 'time' not in k} for row in csv.DictReader(open(f))] for f in ('c/x.csv','long/long.csv')]
sys.exit(a!=b or not a)"; r="0, verify $v, other numbers $?"
        is "$r" "0, verify 0, other numbers 0" "file $how under a run"
    else is "$r" 4 "file $how under a run"; fi
done
# 7 to 9 files from strangers
"$PY" - <<'P'
import h5py, shutil, numpy as np
grown = []
with h5py.File('good.h5') as f: f.visititems(lambda n, o: grown.append(n) if isinstance(o, h5py.Dataset) and o.maxshape and o.maxshape[0] is None else None)
open('grown', 'w').write('\n'.join(grown) + '\n')
for k, n in enumerate(grown):
    shutil.copy('good.h5', f's_grown{k}.h5')
    with h5py.File(f's_grown{k}.h5', 'r+') as f: f[n].resize(2**31, axis=0)
def with_(name, do):
    shutil.copy('good.h5', name)
    with h5py.File(name, 'r+') as f: do(f)
with_('s_root_ring.h5', lambda f: f.__setitem__('bodies/up', f['/']))
with_('s_three_ring.h5', lambda f: (f.create_group('a/b/c'), f.__setitem__('a/b/c/d', f['a'])))
with_('s_virtual.h5', lambda f: f.create_virtual_dataset('VTKHDF/CellData/v', (lambda l: (l.__setitem__(slice(None), h5py.VirtualSource('/etc/hostname', 'x', (4,))), l)[1])(h5py.VirtualLayout((4,), 'f8'))))
with_('s_external.h5', lambda f: f.create_dataset('VTKHDF/PointData/e', (1,), 'f8', external=[('/etc/hostname', 0, 8)]))
with_('s_extlink.h5', lambda f: f.__setitem__('history/e', h5py.ExternalLink('/etc/hostname', '/')))
with_('s_dangling.h5', lambda f: f.__setitem__('bodies/s', h5py.SoftLink('/nowhere')))
def filtered(f):
    d = h5py.h5p.create(h5py.h5p.DATASET_CREATE); d.set_chunk((4,)); d.set_filter(31999, h5py.h5z.FLAG_OPTIONAL, (1,))
    h5py.h5d.create(f.id, b'plugged', h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((4,)), d)
with_('s_filter.h5', filtered)
def strings(f): f.create_dataset('title2', data='x' * 10, dtype=h5py.string_dtype()); f.create_dataset('vl', (2**20,), h5py.vlen_dtype('f8'), chunks=(64,))
with_('s_vlen.h5', strings)
P
bad=; n=0
for f in s_grown*.h5 s_root_ring.h5 s_three_ring.h5 s_virtual.h5 s_external.h5 s_extlink.h5 s_dangling.h5 s_filter.h5; do
    for c in "info $f" "export $f --csv c --vtu v --stl s" "report $f --out r" "run short.json --out $f --resume"; do
        r=$(ulimit -v 4000000; HDF5_PLUGIN_PATH=$PWD code "$B" $c); n=$((n + 1)); [ "$r" = 4 ] || bad="$bad $r:${c// /_}"
    done
done
is "${bad:-none}" none "hostile files: $(wc -l < grown) datasets of 2^31 rows, rings through the root and of three, virtual, external, links, filter: $n commands that did not end with 4"
r=$(ulimit -v 4000000; code "$B" info s_vlen.h5); [ "$r" = 0 ] || [ "$r" = 4 ] && met "unknown lists of lists: $r" || not "unknown lists of lists: $r"
# 10 planted
for n in new journal; do for what in dangling folder pipe hard; do
    rm -rf x.h5*; echo dear > victim; rm -f gone
    case $what in dangling) ln -s gone x.h5.$n ;; folder) mkdir x.h5.$n ;; pipe) mkfifo x.h5.$n ;; hard) ln victim x.h5.$n ;; esac
    r=$(code "$B" run short.json --out x.h5 --quiet --threads 1)
    [ "$(cat victim)" = dear ] && [ ! -e gone ] && { [ "$r" = 0 ] || [ "$r" = 4 ]; } && met "planted $what as .$n: exit $r, nothing touched" || not "planted $what as .$n: exit $r"
done; done
# 11 what a run reads, by other names
cat > g.vtu <<'V'
<VTKFile type="UnstructuredGrid" version="0.1"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="1"><Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray><DataArray type="Int64" Name="offsets" format="ascii">4</DataArray><DataArray type="UInt8" Name="types" format="ascii">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>
V
echo '{"scene":{"bodies":[{"name":"m","shape":{"mesh":"g.vtu"}}]},"rock":{"density":2700,"youngs_modulus":3e10,"poissons_ratio":0.2},"contact":{"friction":0.5},"stages":[{"kind":"load","increments":1}]}' > mesh.json
ln -sf g.vtu soft.vtu; ln -f g.vtu hard.vtu; before=$(sha g.vtu)
for o in ./g.vtu "$PWD/g.vtu" soft.vtu ../"$(basename "$PWD")"/g.vtu; do
    r=$(code "$B" run mesh.json --out "$o" --force); [ "$(sha g.vtu)" = "$before" ] || r="$r and gone"
    is "$r" 2 "mesh written over by the name ${o/$PWD/\$PWD}"; cp -f g.vtu keep 2> /dev/null
done
# A second hard name becomes another file's: the mesh itself stays.
r=$(code "$B" run mesh.json --out hard.vtu --force --quiet); is "$r $(sha g.vtu)" "0 $before" "results under a second hard name of the mesh, which stays"
# 12 deep pointers elsewhere
deep() { "$PY" -c "print('$1'*$2)"; }
echo "{\"cases\":[{\"name\":\"a\",\"case\":\"short.json\",\"set\":{\"$(deep /a 33)\":1}}]}" > p.json; is "$(code "$B" batch p.json --list)" 2 "33 keys in a case's own set"
is "$(code "$B" check short.json --set "$(deep /a 30000)=1")" 1 "30,000 keys in --set"
echo "{\"case\":\"short.json\",\"set\":{\"/x\":$(deep '[' 100000)$(deep ']' 100000)}}" > p.json; is "$(code "$B" batch p.json --list)" 2 "100,000 lists in each other in a plan"
# 13 what a cluster's shell may get to run
for text in 'r\u2028touch PWNED' 'r\rtouch PWNED' 'r$(touch PWNED)' 'r`touch PWNED`' "r'; touch PWNED; '" 'r\u0000x' '-x; touch PWNED'; do
    rm -rf q; mkdir q; cp short.json q/a.json; echo "{\"case\":\"a.json\",\"out\":\"$text\"}" > q/plan.json
    (cd q && PATH=/nonexistent "$B" batch plan.json --slurm > ../o 2> ../e); r=$?
    s=$(find q -name array.sh | head -1)
    [ -z "$s" ] || (cd q && SLURM_ARRAY_TASK_ID=0 timeout 20 sh "${s#q/}" > /dev/null 2>&1)
    find . -name 'PWNED*' | grep -q . && not "out $text: ran" || { [ "$r" = 2 ] || [ -n "$s" ]; } && met "out $text: exit $r, nothing ran" || not "out $text: exit $r, no script"
done
echo '{"cases":[{"name":"../../x","case":"short.json"}]}' > p.json; is "$(code "$B" batch p.json --list) $(grep -c / o)" "0 0" "a member's name with ../ stays in the folder"
# 14 titles and names
for name in '+1' '-1' '@x' '\tx' 'a\nb' '\u202ex' '</VTKFile>' '%n' "a'b\\\"c"; do
    sed "s|\"block\"|\"$(sed 's/[\\|&]/\\&/g' <<< "$name")\"|g; s|\"short\"|\"t\\\\nstatus finished $(sed 's/[\\|&]/\\&/g' <<< "$name")\"|" short.json > n.json
    r=$(code "$B" check n.json)
    if [ "$r" = 0 ]; then
        code "$B" run n.json --out n.h5 --force --quiet > rc; code "$B" export n.h5 --csv c --vtu v > rc; code "$B" report n.h5 --out r > rc
        "$PY" - <<'P' && met "name $name: tables and pages plain" || not "name $name"
import csv, glob, sys, xml.dom.minidom
for f in glob.glob('r/*.svg') + glob.glob('v/*.pvd'): xml.dom.minidom.parse(f)
cells = [c for f in glob.glob('c/n*.csv') for row in csv.reader(open(f, newline='')) for c in row]
def number(c):
    try: float(c); return True
    except ValueError: return False
sys.exit(any(c[:1] in '=+-@\t\r' and c and not number(c) for c in cells))
P
    else is "$r" 1 "name $name refused"; fi
    rm -rf c v r n.h5
done
# 15 check and run
times() { for k in "$@"; do "$PY" - "$k" <<'P'
import sys, json, math
kind, n = sys.argv[1].split(':'); n = int(n)
j = {"rock": {"density": 2700, "youngs_modulus": 3e10, "poissons_ratio": 0.2}, "contact": {"friction": 0.5}, "stages": [{"kind": "load", "increments": 1}]}
if kind == 'bodies': bodies = [{"name": f"b{k}", "shape": {"box": [1, 1, 1]}, "position": [1.5 * (k % 100), 1.5 * (k // 100 % 100), 1.5 * (k // 10000)]} for k in range(n)]
else: bodies = [{"name": "p", "shape": {"polyhedron": [[math.cos(a), math.sin(a), z] for k in range(n // 2) for a in [2 * math.pi * k / (n // 2)] for z in (0, 1)]}}]
json.dump({"scene": {"bodies": bodies}, **j}, open('t.json', 'w'))
P
    s=$(date +%s.%N); r=$(code "$B" check t.json); echo "time     | check of $k: exit $r, $("$PY" -c "import time;print(f'{time.time()-$s:.2f} s')") $(grep -o 'memory .*GB' o | tr -s ' ')"; done; }
times corners:250 corners:500 corners:1000 corners:4000 corners:20000 bodies:2000 bodies:12500 bodies:25000 bodies:50000
echo "{\"cases\":[{\"name\":\"$(deep n 300)\",\"case\":\"short.json\"}]}" > p.json; is "$(code "$B" batch p.json --list)" 2 "a member's name of 300 letters"
