import aeros

with aeros.open_session("ecms/clean_table", plant="symbolic", seed=3) as session:
    result = session.run("clean the table", timeout=600.0)
for step in result.steps:
    print(step.skill, step.outcome, step.ended - step.started)
print(result.reached)
