mkdir -p sv sw   # from the repository; sv: same law, sw: weakest link
C=cases/crushing/grain_between_plates.json
S='--set /scene/bodies/1/shape/grain=[0.015,0.02] --set /scene/press/patch=0.00175 --set /stages/0/bodies/top/displacement/2=-0.0005'
L='--set /scene/bodies/1/shape/grain=[0.06,0.08] --set /scene/bodies/1/position/2=0.06 --set /scene/bodies/2/position/2=0.13 --set /scene/press/patch=0.007 --set /stages/0/bodies/top/displacement/2=-0.002'
R='--set /rock/compressive_strength/reference_size=0.01 --set /rock/tensile_strength/reference_size=0.01'
for s in $(seq 1 30); do
 for g in small middle large; do
  case $g in small) o="$S"; seed=$s;; middle) o=""; seed=$((100+s));; large) o="$L"; seed=$((200+s));; esac
  [ -f sv/${g}_$seed.h5 ] || timeout 60 nice -n 5 target/release/riprap run $C --set /seed=$seed $o --out sv/${g}_$seed.h5 --force --threads 1 --quiet >> sv/log 2>&1
  [ -f sw/${g}_$seed.h5 ] || timeout 60 nice -n 5 target/release/riprap run $C --set /seed=$seed $o $R --out sw/${g}_$seed.h5 --force --threads 1 --quiet >> sw/log 2>&1
 done
done
