"""What a change of modules or of a site newly allows and newly denies."""
