import aeros

with aeros.open_session("ecms/clean_table", out="out", state="state") as session:
    for event in session.events("clean the table"):
        if event.kind == "step-ended":
            print(f"{event.time:.1f} s: {event.text}")
    print((session.out / "audit.jsonl").stat().st_size > 0)
