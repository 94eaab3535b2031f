import aeros

report: aeros.Report = aeros.verify("ecms/")
for module in report.modules:
    print(module.name, module.conclusion.value, module.claim_count)
    for problem in module.diagnostics:
        print(problem.code, problem.headline)
